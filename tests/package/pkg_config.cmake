# SPDX-License-Identifier: BSD-3-Clause
# Without CMake: a program compiled and run with what pkg-config says of the jml installed in PREFIX, moved to where it
# was not installed.
find_program(PKG_CONFIG NAMES pkg-config pkgconf)
if(NOT PKG_CONFIG)
  message("no pkg-config here")
  return()
endif()
file(REMOVE_RECURSE ${BUILD})
file(COPY ${PREFIX}/ DESTINATION ${BUILD}/moved)
set(ENV{PKG_CONFIG_PATH} ${BUILD}/moved/share/pkgconfig)
execute_process(COMMAND ${PKG_CONFIG} --cflags jml OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
string(FIND "${flags}" "-I${BUILD}/moved/" place)
if(NOT place EQUAL 0)
  message(FATAL_ERROR "pkg-config says ${flags}")
endif()
separate_arguments(flags UNIX_COMMAND "${flags}")
execute_process(COMMAND ${COMPILER} -std=c++20 ${flags} -I${SOURCE} ${SOURCE}/tracking.cpp ${SOURCE}/user/main.cpp -o ${BUILD}/user
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${BUILD}/user COMMAND_ERROR_IS_FATAL ANY)
