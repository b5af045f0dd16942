# kilotwin_add_guest(TARGET NAME PROGRAM [API]): builds guests/NAME.so, which TARGET loads when it
# runs. PROGRAM is a .c file or a folder of them; API "module" says that it is a Kilogrid module's. The host's own builder does it, with this build's C
# compiler and, after its own flags, KILOTWIN_GUEST_CFLAGS.
set(KILOTWIN_GUEST_CFLAGS "" CACHE STRING "Further flags for the robot programs of the tests")
set(KILOTWIN_BUILD_GUEST ${CMAKE_CURRENT_LIST_DIR}/build_guest.py)

function(kilotwin_add_guest target name program)
  cmake_path(ABSOLUTE_PATH program)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${program}/*.[ch])
  file(GLOB_RECURSE own CONFIGURE_DEPENDS
    ${PROJECT_SOURCE_DIR}/emulator/robots/native/*.[ch] ${PROJECT_SOURCE_DIR}/emulator/robots/native/*.ld
    ${PROJECT_SOURCE_DIR}/emulator/robots/native/*.map ${PROJECT_SOURCE_DIR}/firmware/kilolib/include/*.h
    ${PROJECT_SOURCE_DIR}/firmware/kilolib/core/*.[ch]
    ${PROJECT_SOURCE_DIR}/firmware/kilogrid/*.[ch]
    ${PROJECT_SOURCE_DIR}/kilogrid_modules/runtime/include/*.h
    ${PROJECT_SOURCE_DIR}/kilogrid_modules/runtime/core/*.h)
  set(guest ${CMAKE_CURRENT_BINARY_DIR}/guests/${name}.so)
  add_custom_command(
    OUTPUT ${guest}
    COMMAND ${CMAKE_COMMAND} -E env PYTHONPATH=${PROJECT_SOURCE_DIR}/host_tools
      KILOTWIN_CC=${CMAKE_C_COMPILER} KILOTWIN_CFLAGS=${KILOTWIN_GUEST_CFLAGS}
      ${Python_EXECUTABLE} -S ${KILOTWIN_BUILD_GUEST} ${program} ${guest} ${ARGN}
    DEPENDS ${program} ${sources} ${own} ${KILOTWIN_BUILD_GUEST}
      ${PROJECT_SOURCE_DIR}/host_tools/kilotwin/programs/native/guest.py
      ${PROJECT_SOURCE_DIR}/host_tools/kilotwin/experiment/programs.py
    COMMENT "Building guest ${name}"
    VERBATIM)
  add_custom_target(${target}.${name} DEPENDS ${guest})
  add_dependencies(${target} ${target}.${name})
endfunction()
