# SPDX-License-Identifier: BSD-3-Clause
# Compiles CASE by the command COMPILE with MISTAKE defined, up to the first error; passes if there is one and it is the
# sentence of the case's "// must say: " line.
file(READ ${CASE} text)
string(REGEX MATCH "// must say: ([^\n]+)" line "${text}")
set(sentence "${CMAKE_MATCH_1}")
execute_process(COMMAND ${CMAKE_COMMAND} -E env LC_ALL=C ${COMPILE} -Wfatal-errors -DMISTAKE ${CASE}
                RESULT_VARIABLE result ERROR_VARIABLE output OUTPUT_VARIABLE output)
if(result EQUAL 0)
  message(FATAL_ERROR "it compiles, and must not: ${sentence}")
endif()
string(FIND "${output}" "error: " first_error)
string(SUBSTRING "${output}" ${first_error} -1 errors)
string(REGEX MATCH "^[^\n]*" first_line "${errors}")
string(FIND "${first_line}" "${sentence}" position)
if(sentence STREQUAL "" OR position EQUAL -1)
  message(FATAL_ERROR "the first error must say\n  ${sentence}\nand the compiler said\n${output}")
endif()
message(STATUS "${first_line}")
