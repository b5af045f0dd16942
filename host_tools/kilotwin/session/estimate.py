"""How long experiments take, more or less, before anything of them has run."""

from kilotwin.experiment.experiment import Experiment, Group
from kilotwin.experiment.schema.medium import MEDIA

# A robot's second, and a module's: the median of labs' programs.
_TRANSLATED_CPU_S = 1 / 50_000
_MODULE_CPU_S = 1 / 250_000
_BOARD_CPU_S = 1 / 400


def cpu_s_of(experiment: Experiment, *, natively: bool = False) -> float:
    """CPU time of a run; `natively`: as if the programs that run translated did not."""
    each_second = sum(
        group.count * _robot_cpu_s(group, experiment.keys.medium.kind, natively)
        for group in experiment.groups
    )
    modules = experiment.modules
    if modules is not None:
        each_second += modules.count * (_BOARD_CPU_S if modules.on_board else _MODULE_CPU_S)
    return each_second * experiment.keys.duration_s


def _robot_cpu_s(group: Group, medium: str, natively: bool) -> float:
    if group.on_board:
        return _BOARD_CPU_S
    return (
        _TRANSLATED_CPU_S
        if group.tier == "translated" and not natively
        else MEDIA[medium].robot_cpu_s
    )
