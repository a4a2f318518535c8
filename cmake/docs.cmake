# SPDX-License-Identifier: BSD-3-Clause
# The reference: target docs writes docs/html/index.html of the build folder, and fails where a public name has no
# documentation or doxygen warns of anything else. The test `docs` is the same.
find_program(JML_DOXYGEN doxygen)
if(NOT JML_DOXYGEN)
  set(JML_DOXYGEN_MISSING "skipped: there is no doxygen (Debian, Ubuntu: doxygen)")
  add_custom_target(docs COMMAND ${CMAKE_COMMAND} -E echo ${JML_DOXYGEN_MISSING})
  if(JML_BUILD_TESTS)
    add_test(NAME docs COMMAND ${CMAKE_COMMAND} -E echo ${JML_DOXYGEN_MISSING})
    set_tests_properties(docs PROPERTIES LABELS "docs;nightly" SKIP_REGULAR_EXPRESSION "skipped:")
  endif()
  return()
endif()

set(JML_DOCS_DIR ${PROJECT_BINARY_DIR}/docs)
file(MAKE_DIRECTORY ${JML_DOCS_DIR})
configure_file(cmake/Doxyfile.in ${JML_DOCS_DIR}/Doxyfile @ONLY)
add_custom_target(docs COMMAND ${JML_DOXYGEN} ${JML_DOCS_DIR}/Doxyfile
                  COMMAND ${CMAKE_COMMAND} -E echo "The reference: ${JML_DOCS_DIR}/html/index.html" VERBATIM)
if(JML_BUILD_TESTS)
  add_test(NAME docs COMMAND ${JML_DOXYGEN} ${JML_DOCS_DIR}/Doxyfile)
  set_tests_properties(docs PROPERTIES LABELS "docs;nightly")  # by night: each version of doxygen warns of other things
endif()
