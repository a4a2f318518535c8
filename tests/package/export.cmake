# SPDX-License-Identifier: BSD-3-Clause
# Configures and builds the exporting project in SOURCE with OPTIONS, installs it to BUILD/prefix, and has its user build
# and run twice: against what was installed, and against the build tree.
file(REMOVE_RECURSE ${BUILD})
set(ENV{CMAKE_BUILD_PARALLEL_LEVEL} 1)
macro(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\nended with ${result}:\n${output}")
  endif()
endmacro()
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD}/build -G ${GENERATOR} ${OPTIONS})
run(${CMAKE_COMMAND} --build ${BUILD}/build)
run(${CMAKE_COMMAND} --install ${BUILD}/build --prefix ${BUILD}/prefix)

file(GLOB_RECURSE of_jml ${BUILD}/build/jmlConfig.cmake)
get_filename_component(jml_folder ${of_jml} DIRECTORY)
foreach(where "installed;-DCMAKE_PREFIX_PATH=${BUILD}/prefix" "build_tree;-Dtracking_DIR=${BUILD}/build;-Djml_DIR=${jml_folder}")
  list(POP_FRONT where name)
  run(${CMAKE_COMMAND} -S ${SOURCE}/user -B ${BUILD}/${name} -G ${GENERATOR} ${OPTIONS} ${where})
  run(${CMAKE_COMMAND} --build ${BUILD}/${name})
  run(${BUILD}/${name}/consumer_user)
  # Found where it was to be found, and nowhere else.
  load_cache(${BUILD}/${name} READ_WITH_PREFIX its_ jml_DIR)
  string(FIND "${its_jml_DIR}" "${BUILD}/" position)
  if(NOT position EQUAL 0)
    message(FATAL_ERROR "${name}: jml was found in ${its_jml_DIR}")
  endif()
endforeach()
