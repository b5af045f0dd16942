"""A swarm flashed over the air: an upload carried out on a link, and what is said of it.

Whatever ends it, the last line says what robots hold and what to type next.
"""

import shlex
from collections.abc import Sequence
from typing import Any

from kilotwin.errors import DeviceError, InterruptError
from kilotwin.files.headers import ALL_ROBOTS
from kilotwin.table.flash.progress import Progress, stepwise
from kilotwin.table.flash.upload import (
    Action,
    Announce,
    Ask,
    Pause,
    Repeat,
    Robot,
    SendPage,
    Upload,
)
from kilotwin.table.grid.clock import Clock
from kilotwin.table.links.robot_link import LoaderState, Report, RobotLink, RobotState
from kilotwin.table.links.roll_call import WITHOUT_UID, aligned, place
from kilotwin.units import counted

_RUNNING = (RobotState.SETUP, RobotState.RUNNING)


class SwarmFlasher:
    """One upload on one link."""

    def __init__(
        self,
        upload: Upload,
        link: RobotLink,
        clock: Clock,
        progress: Progress,
        again: Sequence[str] = (),
    ) -> None:
        """`again`: the command that was typed."""
        self._upload, self._link, self._clock = upload, link, clock
        self._again = again
        self._show = stepwise(progress)

    def run(self) -> None:
        """All of it. Ctrl-C is an InterruptError, a device that is gone a DeviceError."""
        script = self._upload.script()
        try:
            action = next(script)
            while True:
                answers = self._perform(action)
                action = script.send(answers)
                self._show(self._upload.progress.text, self._upload.progress.share)
        except StopIteration:
            return
        except DeviceError as error:
            raise DeviceError(f"{error}; {self.state()}", detail=error.detail) from None
        except KeyboardInterrupt:
            raise InterruptError(f"broken off; {self.state()}") from None

    def state(self) -> str:
        """Programs that robots hold, and how to go on."""
        upload = self._upload
        again = f"type the same again: {shlex.join(self._again)}" if self._again else ""
        if not upload.called:
            what = "robots were not touched"
        elif not upload.verifiable:
            what = f"{upload.laps} laps were sent, and what robots hold is not known"
        else:
            loading = [u for u in upload.failed if upload.robots[u].image_id is not None]
            have = f"{len(upload.verified)} robots have all of the program"
            what = f"{have}, {len(loading)} have a part and wait for the rest in their boot loaders"
        return "; ".join(part for part in (what, again) if part)

    def _perform(self, action: Action) -> Sequence[Report]:
        match action:
            case Repeat(message, hold_s):
                self._link.repeat(message, hold_s)
            case Announce():
                self._link.announce(self._upload.wish.image)
            case SendPage(page):
                self._link.send_page(page, self._upload.wish.image.pages[page])
            case Pause(seconds):
                self._clock.sleep(seconds)
            case Ask(first, slots_log2, nonce, uid):
                return self._link.ask(first, slots_log2, nonce, uid)
        return ()


def as_dict(upload: Upload) -> dict[str, Any]:
    """The --json object. `verified` is null where nothing can be known."""
    image = upload.wish.image
    return {
        "pages": len(image.pages),
        "crc": image.crc16,
        "image_id": f"{image.image_id:08X}",
        "build_id": str(image.build_id) if image.build_id else None,
        "laps": upload.laps,
        "verifiable": upload.verifiable,
        "done": upload.done,
        "verified": upload.verified if upload.verifiable else None,
        "failed": upload.failed if upload.verifiable else None,
        "never_heard": upload.unknown,
        "started": upload.started,
        "running": upload.running,
        "robots": [_robot_dict(robot) for robot in _in_order(upload)] if upload.verifiable else [],
    }


def text(upload: Upload) -> str:
    """The table by uid, and the last lines for people."""
    lines = [_table(upload)] if upload.verifiable and upload.robots else []
    return "\n".join([*lines, *_summary(upload)])


def state_of(robot: Robot) -> str:
    """A robot's state, in a few words."""
    if robot.verified:
        if robot.application is None:
            return "verified" if robot.state is None else "verified, waits in its boot loader"
        return "verified, runs" if robot.application in _RUNNING else "verified, started"
    if robot.application is not None:
        return "still in its old program"
    match robot.state:
        case LoaderState.WRONG:
            return "all pages, but the CRC is wrong"
        case LoaderState.NOTHING:
            return "in its boot loader, without a program"
        case None if not robot.heard:
            return "no answer"
        case _:
            return "loading"


def _robot_dict(robot: Robot) -> dict[str, Any]:
    return {
        "uid": robot.uid,
        "verified": robot.verified,
        "state": state_of(robot),
        "missing": sorted(robot.missing) if robot.heard and not robot.verified else [],
        "image_id": None if robot.image_id is None else f"{robot.image_id:08X}",
        "module": list(robot.module) if robot.module else None,
        "cell": robot.cell,
    }


def _in_order(upload: Upload) -> list[Robot]:
    return [upload.robots[uid] for uid in sorted(upload.robots)]


def _table(upload: Upload) -> str:
    rows = [("uid", "module", "cell", "missing", "image", "state")]
    for robot in _in_order(upload):
        rows.append(
            (
                str(robot.uid),
                *place(robot.module, robot.cell),
                str(len(robot.missing)) if robot.heard else "?",
                "" if robot.image_id is None else f"{robot.image_id:08X}",
                state_of(robot),
            )
        )
    return "\n".join(aligned(rows))


def _summary(upload: Upload) -> list[str]:
    image = upload.wish.image
    what = f"{counted(len(image.pages), 'page')}, image {image.image_id:08X}"
    laps = f"{upload.laps} laps" if upload.laps != 1 else "1 lap"
    if not upload.verifiable:
        why = "no robot answers" if upload.verifies else "no answer comes back by this way"
        return [
            f"sent {laps} of {what}; not verifiable: {why}",
            "robots that have all of it started it (LED green, then blinking green)",
        ]
    expected = len(upload.robots) + upload.unknown
    if not upload.done:
        return _failure(upload, f"{len(upload.verified)} of {expected}")
    lines = [f"flashed and verified: {expected} of {expected} robots, {what}, {laps}"]
    if upload.wish.run:
        lines.append(_running(upload))
    if ALL_ROBOTS in upload.robots:
        lines.append(WITHOUT_UID)
    return lines


def _failure(upload: Upload, how_many: str) -> list[str]:
    lines = [f"{how_many} robots are verified; the program was not started"]
    if upload.failed:
        lines.append(f"failed: {', '.join(map(str, upload.failed))}")
    if upload.unknown:
        lines.append(f"never heard: {upload.unknown} of the {upload.wish.count} expected")
    lines.append(
        "silent ones are asleep, out of reach, or have an original boot loader; type the same "
        "again to go on"
    )
    return lines


def _running(upload: Upload) -> str:
    if not upload.answers_when_running:
        return "they were told to run; a program of another runtime does not say that it does"
    return f"{len(upload.running)} of {len(upload.robots)} robots say that they run"
