"""Programs that were written for the Kilombo simulator build as they are."""

from pathlib import Path

import pytest

from kilotwin.experiment.programs import find_program
from kilotwin.programs.native.guest import build

HERE = Path("/nowhere")

pytestmark = pytest.mark.usefixtures("cache")


def test_programs_of_the_kilombo_simulator_build(tmp_path: Path) -> None:
    (tmp_path / "k.c").write_text("""
#include <kilombo.h>
typedef struct { int count; } USERDATA;
REGISTER_USERDATA(USERDATA)
void setup(void) { mydata->count = 1; }
void loop(void) { mydata->count++; }
int main(void) {
    kilo_init();
    SET_CALLBACK(botinfo, setup);
    kilo_start(setup, loop);
    return 0;
}
""")
    assert build(find_program(str(tmp_path / "k.c"), HERE)).name == "k"


@pytest.mark.parametrize("header", ["<kilombo.h>", '"kilolib.h"'])
@pytest.mark.parametrize("declaration", ["", "extern char *(*callback_botinfo)(void);"])
def test_programs_that_say_they_are_simulated_set_callbacks_by_name(
    header: str, declaration: str, tmp_path: Path
) -> None:
    """Kilombo's older programs, which define SIMULATOR themselves."""
    (tmp_path / "k.c").write_text(f"""
#define SIMULATOR
#include {header}
typedef struct {{ int count; }} USERDATA;
REGISTER_USERDATA(USERDATA)
{declaration}
char *botinfo(void);
void setup(void) {{ mydata->count = 1; }}
void loop(void) {{ mydata->count++; }}
int main(void) {{
    kilo_init();
    callback_botinfo = botinfo;
    SET_CALLBACK(reset, setup);
    kilo_start(setup, loop);
    return 0;
}}
char *botinfo(void) {{ return "bot"; }}
""")
    assert build(find_program(str(tmp_path / "k.c"), HERE)).name == "k"
