# SPDX-License-Identifier: BSD-3-Clause
# cmake -DPROGRAM=… -DOUTPUT=… [-DARGUMENT=…] -P run_demo.cmake: runs a demo, and keeps what it prints for the index page.
execute_process(COMMAND ${PROGRAM} ${OUTPUT} ${ARGUMENT} OUTPUT_VARIABLE printed ECHO_OUTPUT_VARIABLE
                RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} ended with ${result}")
endif()
file(WRITE ${OUTPUT}/console.txt "${printed}")
message("Figures and summary.csv: ${OUTPUT}\n")
