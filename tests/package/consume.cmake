# SPDX-License-Identifier: BSD-3-Clause
# Configures SOURCE afresh in BUILD with OPTIONS, builds and runs it; where SAYS is given, configuring must fail so.
file(REMOVE_RECURSE ${BUILD})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} -G ${GENERATOR} ${OPTIONS}
                RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(NOT SAYS STREQUAL "")
  string(REGEX REPLACE "[ \n]+" " " one_line "${output}")  # messages are wrapped
  string(FIND "${one_line}" "${SAYS}" position)
  if(result EQUAL 0 OR position EQUAL -1)
    message(FATAL_ERROR "configuring must fail and say\n  ${SAYS}\nand it said (exit code ${result})\n${output}")
  endif()
  return()
endif()
if(NOT result EQUAL 0)
  message(FATAL_ERROR "configuring failed:\n${output}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} --build ${BUILD} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB programs ${BUILD}/consumer_* ${BUILD}/flight)
if(programs STREQUAL "")
  message(FATAL_ERROR "no program was built")
endif()
foreach(program IN LISTS programs)
  execute_process(COMMAND ${program} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
