"""Whether a table that a host takes over runs, and runs the experiment that it records."""

from kilotwin.errors import DeviceError
from kilotwin.experiment.spec.grid_layout import Module
from kilotwin.experiment.spec.grid_plan import GridPlan
from kilotwin.table.can.protocol import Health, ModuleState
from kilotwin.table.grid.clock import WallClock
from kilotwin.table.grid.console import carry_out
from kilotwin.table.grid.controller import Controller, NoListener
from kilotwin.table.grid.in_turn import is_held
from kilotwin.table.grid.links import Links


def check_runs(plan: GridPlan, links: Links) -> None:
    """DeviceError if modules say that they do not run, or have another configuration.

    Asks each for its health, and polls none, so that reports stay where they are. Original modules
    do not answer, and are taken to run.
    """
    layout = plan.layout.on_buses(len(links))
    controller = Controller(layout, plan.settings, links, NoListener())
    clock = WallClock()
    controller.step(clock.now_s())
    controller.request_health(layout.modules())
    carry_out(controller, clock, [f"bus {bus}" for bus in range(len(links))])
    answers = controller.health
    running = [m for m, answer in answers.items() if answer.state == ModuleState.RUNNING]
    if answers and not running:
        raise DeviceError("--join: none of the modules runs; leave --join out")
    for module in sorted(running):
        if not _is_of(plan, module, answers[module]):
            raise DeviceError(
                f"--join: module {module[0]}-{module[1]} runs with another configuration than this "
                "experiment's; name the experiment that runs, or leave --join out"
            )


def _is_of(plan: GridPlan, module: Module, answer: Health) -> bool:
    """Whether it is what the plan gives the module, at the begin or later."""
    changes = [order.configuration or {} for order in plan.orders]
    contents = [part[module] for part in (plan.configuration, *changes) if module in part]
    size, crc = answer.config_size, answer.config_crc
    return not contents or any(is_held(content, size, crc) for content in contents)
