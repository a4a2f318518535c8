# SPDX-License-Identifier: BSD-3-Clause
# The same bytes from the plain program and from any number of MPI ranks, with and without a journal.
# -D PLAIN=, -D ON_RANKS= (campaign_program without and with JML_ON_RANKS), -D MPIEXEC=, -D WORK= a directory.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
set(ENV{OMPI_ALLOW_RUN_AS_ROOT} 1)
set(ENV{OMPI_ALLOW_RUN_AS_ROOT_CONFIRM} 1)
set(ENV{OMPI_MCA_rmaps_base_oversubscribe} 1)

function(must_succeed out)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text TIMEOUT 60)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${code}\n${text}")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()
function(must_equal one other)
  foreach(ending csv json)
    file(READ ${WORK}/${one}.${ending} first HEX)
    file(READ ${WORK}/${other}.${ending} second HEX)
    if(first STREQUAL "" OR NOT first STREQUAL second)
      message(FATAL_ERROR "${one}.${ending} and ${other}.${ending} differ")
    endif()
  endforeach()
endfunction()

must_succeed(text ${PLAIN} ${WORK}/plain 400 2)
foreach(ranks 1 2 3)
  must_succeed(text ${MPIEXEC} -n ${ranks} ${ON_RANKS} ${WORK}/ranks_${ranks} 400 2)
  must_equal(plain ranks_${ranks})
endforeach()

# 400 runs of 5 ms take 2 s in one thread: killed after 1 s, then taken over by two ranks.
execute_process(COMMAND ${PLAIN} ${WORK}/killed 400 1 ${WORK}/journal 5 RESULT_VARIABLE code TIMEOUT 1
                OUTPUT_QUIET ERROR_QUIET)
if(EXISTS ${WORK}/killed.csv)
  message(FATAL_ERROR "it was to be killed: ${code}")
endif()
must_succeed(text ${MPIEXEC} -n 2 ${ON_RANKS} ${WORK}/resumed 400 1 ${WORK}/journal)
must_equal(plain resumed)
if(NOT text MATCHES "[1-9][0-9]* blocks taken over")
  message(FATAL_ERROR "no block was taken over: ${text}")
endif()

# What goes wrong ends all ranks with a message: options, a journal of other runs, an exception in a run.
function(must_fail words)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text TIMEOUT 60)
  if(code EQUAL 0 OR NOT text MATCHES "${words}")
    message(FATAL_ERROR "${ARGN}: ${code}, expected '${words}'\n${text}")
  endif()
endfunction()
must_fail("-1 threads" ${MPIEXEC} -n 2 ${ON_RANKS} ${WORK}/none 400 -1)
must_fail("belongs to another campaign" ${MPIEXEC} -n 2 ${ON_RANKS} ${WORK}/none 401 1 ${WORK}/journal)
must_fail("y is too large" ${MPIEXEC} -n 2 ${ON_RANKS} ${WORK}/none 4000 1 ${WORK}/thrown -1)
