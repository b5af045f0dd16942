"""Ways to robots by infrared: a Kilogrid, an overhead controller, a dispatcher."""
