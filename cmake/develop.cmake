# SPDX-License-Identifier: BSD-3-Clause
# For work on jml itself: what tests, examples and benchmarks share. None of it reaches a user of jml::jml.

add_library(jml_warnings INTERFACE)
target_compile_options(jml_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror)

# The library forces its inlining, for speed. A program that is run once does not need that, and the compiler is done in
# two thirds of the time: here it is left to the compiler. What is computed is the same.
add_library(jml_plain_inlining INTERFACE)
target_compile_definitions(jml_plain_inlining INTERFACE JML_PLAIN_INLINING)

# GCC collects its garbage first at half a gigabyte: a twelfth of the time, for a fifth more memory.
if(PROJECT_IS_TOP_LEVEL AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(--param=ggc-min-heapsize=524288)
endif()

# A fixed-size filter takes the compiler up to 1.6 GB: no more jobs at a time than the memory holds.
cmake_host_system_information(RESULT jml_jobs QUERY NUMBER_OF_LOGICAL_CORES)
cmake_host_system_information(RESULT jml_memory QUERY TOTAL_PHYSICAL_MEMORY)
math(EXPR jml_jobs_in_memory "${jml_memory} / 1600")
if(jml_jobs_in_memory LESS jml_jobs)
  set(jml_jobs ${jml_jobs_in_memory})
endif()
if(jml_jobs LESS 1)
  set(jml_jobs 1)
endif()
set_property(GLOBAL APPEND PROPERTY JOB_POOLS jml_compile=${jml_jobs})
if(PROJECT_IS_TOP_LEVEL)
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)  # for the targets of bench/compile
  set(CMAKE_JOB_POOL_COMPILE jml_compile)
endif()
