# SPDX-License-Identifier: BSD-3-Clause
# Makes the single header in BUILD, and compiles and runs EXAMPLES, with commas, against it. ALONE: it is all there is;
# otherwise an example may also name headers that are in it, and such as are not, which then get it for what they include.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE ${BUILD})
execute_process(COMMAND ${CMAKE_COMMAND} -D FOLDER=${SOURCE}/include -D VERSION=${VERSION} -D LICENSE=${SOURCE}/LICENSE
                        -D OUTPUT=${BUILD} -P ${SOURCE}/cmake/single_header.cmake COMMAND_ERROR_IS_FATAL ANY)
set(flags -I${BUILD})
if(NOT ALONE)
  file(STRINGS ${BUILD}/headers.txt headers)
  list(REMOVE_ITEM headers jml/jml.hpp)
  foreach(header IN LISTS headers)
    file(WRITE ${BUILD}/instead/${header} "#include <jml/jml.hpp>\n")
  endforeach()
  list(APPEND flags -I${BUILD}/instead -I${SOURCE}/include -I${SOURCE}/tests)
endif()
string(REPLACE "," ";" EXAMPLES "${EXAMPLES}")
foreach(example IN LISTS EXAMPLES)
  execute_process(COMMAND ${COMPILER} -std=c++20 -O0 -Wall -Wextra -Werror ${flags} -isystem ${EIGEN}
                          ${SOURCE}/examples/${example}.cpp -o ${BUILD}/example COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${BUILD}/example COMMAND_ERROR_IS_FATAL ANY)
endforeach()
