# The last steps of an image, the same for robots and modules: its build id, linking, and the .hex.
# `kilotwin build` takes the same steps (host_tools/kilotwin/programs/image/image.py), and a test compares the
# bytes. Both Makefiles include it; they set FIRMWARE, LIBRARY, and HELPER_OBJECTS if there are any.

KILOTWIN_VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' $(FIRMWARE)/../pyproject.toml)

# build_id_option(robot or module, program): the text that firmware/build_id.c takes, quoted for the
# shell. Its words have no spaces: other characters of a name become underscores.
build_id_option = "-DBUILD_ID=\"$1\
 $$(printf %s '$2' | LC_ALL=C tr -c 'A-Za-z0-9._+-' _ | cut -b -40)\
 avr-gcc-$$($(AVR_CC) --version | sed -n '1s/.* //p') kilotwin-$(KILOTWIN_VERSION)\""

# symbols(objects): what others can use of them. wanted_helpers(objects): the helpers of which a
# program's objects define nothing themselves (as host_tools/kilotwin/programs/apis.py has it).
symbols = $(AVR_NM) -g --defined-only -P $1 | sed -n 's/ .*//p'
wanted_helpers = $$(own=$$($(call symbols,$1)); for helper in $(HELPER_OBJECTS); do \
    [ "$$($(call symbols,$$helper) | grep -cxF "$$own")" != 0 ] || echo $$helper; done)

# link(objects, build id): makes $@.
link = rm -f $@.helpers.a; helpers=$(call wanted_helpers,$1); \
    [ -z "$$helpers" ] || $(AVR_AR) rcs $@.helpers.a $$helpers; \
    $(AVR_CC) $(AVR_CHIP) $(AVR_LINK) -Wl,-T,$(FIRMWARE)/build_id.ld $1 $2 \
        $${helpers:+$@.helpers.a} $(LIBRARY) -lm -o $@

# to_hex: makes $@ of $<.
to_hex = $(AVR_OBJCOPY) -O ihex $(AVR_NOT_FLASHED:%=-R %) $< $@
