"""`kilotwin build --hex` and `--show`: an image to flash, and what it takes of the chip."""

import shutil
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kilotwin.errors import InputError, RunError, cause_of
from kilotwin.experiment.programs import HEX_SUFFIXES, Program
from kilotwin.files.drafts import draft_of
from kilotwin.files.flash_image import read_hex
from kilotwin.files.headers import PAGES
from kilotwin.programs.cache import Notify
from kilotwin.programs.image.image import Image, build_image
from kilotwin.programs.image.image_size import FLASH_BYTES, RAM_BYTES, size_of
from kilotwin.programs.linking import TARGETS, wrong_target


def build_hex(program: Program, output: Path, notify: Notify) -> dict[str, Any]:
    """The --json object. `output` and the .elf beside it are written, both or none.

    InputError for a program that does not compile, that is for the other target, or an `output`
    that cannot be written; RunError if the image does not fit.
    """
    elf = output.with_suffix(".elf")
    if output.suffix.lower() not in HEX_SUFFIXES:
        raise InputError(f"--hex {output}: not the name of a .hex file; write {output}.hex")
    try:
        image = build_image(program, notify)
    except InputError as error:
        raise wrong_target(program) or error from None
    size = size_of(image.elf)
    if size.flash > FLASH_BYTES:  # the linker knows the boot section as flash, too
        raise RunError(
            f"{program.written}: takes {size.flash:,} bytes of flash, an image has at most "
            f"{FLASH_BYTES:,} ({PAGES} pages); leave out floating point, printf or tables"
        )
    content = _content(image.hex)
    _copy(image, output, elf)
    return {
        "program": program.name,
        "for": program.target,
        "sources": [str(source) for source in program.sources],
        "hex": str(output),
        "elf": str(elf),
        "ram_bytes": size.ram,
        "ram_budget_bytes": RAM_BYTES,
        "left_out_bytes": size.left_out,
        **content,
        "key": image.key,
        "compiler": image.compiler,
    }


def show_hex(file: Path) -> dict[str, Any]:
    """The --json object of a .hex file that exists, ours or another one."""
    return {"hex": str(file), **_content(file)}


def _copy(image: Image, output: Path, elf: Path) -> None:
    try:
        if output.is_dir() or elf.is_dir():
            raise IsADirectoryError("is a folder")
        # The .hex comes last: a program that waits for it finds the .elf too.
        with draft_of(output) as hex_draft, draft_of(elf) as elf_draft:
            shutil.copyfile(image.hex, hex_draft)
            shutil.copyfile(image.elf, elf_draft)
    except OSError as error:
        reason = cause_of(error)
        raise InputError(f"--hex {output}: {reason}; name another file") from None


def _content(file: Path) -> dict[str, Any]:
    image = read_hex(file)
    written = image.build_id
    return {
        "flash_bytes": len(image.content),
        "flash_budget_bytes": FLASH_BYTES,
        "pages": len(image.pages),
        "pages_budget": PAGES,
        "crc16": f"{image.crc16:04X}",
        "image_id": f"{image.image_id:08X}",
        "build_id": str(written) if written else None,
        "built_from": asdict(written) if written else None,
    }


def built_text(report: dict[str, Any]) -> str:
    """The text for an image that was built."""
    ram, budget = report["ram_bytes"], report["ram_budget_bytes"]
    lines = [
        f"{report['program']}, for {TARGETS[report['for']]}: {report['hex']}, {report['elf']}",
        _flash_line(report),
        f"  RAM    {ram:6,} of {budget:,} bytes of variables ({ram / budget:.1%})",
        *_id_lines(report),
    ]
    lines += [_left_out(name, count) for name, count in report["left_out_bytes"].items()]
    return "\n".join(lines)


def shown_text(report: dict[str, Any]) -> str:
    """The text for a .hex file."""
    return "\n".join([f"{report['hex']}:", _flash_line(report), *_id_lines(report)])


def _flash_line(report: dict[str, Any]) -> str:
    flash, budget = report["flash_bytes"], report["flash_budget_bytes"]
    pages = f"{report['pages']} of {report['pages_budget']} pages"
    return f"  flash  {flash:6,} of {budget:,} bytes ({flash / budget:.1%}; {pages})"


def _id_lines(report: dict[str, Any]) -> Sequence[str]:
    none = "none: not made by this version of kilotwin"
    return (
        f"  image  {report['image_id']}, CRC-16 {report['crc16']}",
        f"  built  {report['build_id'] or none}",
    )


def _left_out(section: str, count: int) -> str:
    what = "a .hex has flash only"
    if section == ".eeprom":
        what += ", and the EEPROM holds the calibration: write it from the program"
    return f"  {count} bytes of {section} are left out: {what}"
