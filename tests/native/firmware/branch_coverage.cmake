# check_every_branch(tests fixture sources...): a test that fails if any branch of the sources was not
# taken, named after `tests`, e.g. `firmware.`. What counts needs FIXTURES_SETUP <fixture>_ran and
# FIXTURES_REQUIRED <fixture>_counts_cleared. With gcc only, which counts.
set(branch_coverage "${CMAKE_CURRENT_LIST_DIR}/branch_coverage.py")
function(check_every_branch tests fixture)
  if(NOT CMAKE_C_COMPILER_ID STREQUAL "GNU")
    return()
  endif()
  find_program(PYTHON3 NAMES /usr/bin/python3 python3 REQUIRED)
  set(coverage "${PYTHON3}" "${branch_coverage}")
  add_test(NAME ${tests}clear_counts COMMAND ${coverage} clear "${CMAKE_CURRENT_BINARY_DIR}")
  set_tests_properties(${tests}clear_counts PROPERTIES FIXTURES_SETUP ${fixture}_counts_cleared)
  add_test(NAME ${tests}every_branch_was_taken
    COMMAND ${coverage} check "${CMAKE_CURRENT_BINARY_DIR}" ${ARGN})
  set_tests_properties(${tests}every_branch_was_taken PROPERTIES FIXTURES_REQUIRED ${fixture}_ran)
endfunction()
