"""Many runs of one experiment, varied: the plan, where it runs, and the data set it leaves."""
