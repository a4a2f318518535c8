# SPDX-License-Identifier: BSD-3-Clause
# The optional components. Read by jml's own build and, installed as jmlComponents.cmake, by find_package(jml).

# jml_find_component(<component> <targets> <missing>): sets <targets> to what jml::<component> links besides jml::jml;
# or sets it empty, and <missing> to what is missing. A function, so that the packages' variables stay in here.
function(jml_find_component component targets missing)
  set(${targets} "" PARENT_SCOPE)
  # For each package: its name, the target that must exist, what people call it, Debian's name.
  if(component STREQUAL "ceres")
    set(packages "Ceres|Ceres::ceres|Ceres Solver|libceres-dev")
  elseif(component STREQUAL "cvode")
    set(packages "")
    foreach(part cvode nvecserial sunmatrixdense sunlinsoldense sunnonlinsolfixedpoint)
      list(APPEND packages "SUNDIALS|SUNDIALS::${part}|SUNDIALS 6.4 to 7|libsundials-dev")
    endforeach()
  elseif(component MATCHES "^(campaign|mpi)$")
    set(packages "Threads|Threads::Threads|a thread library|libc6-dev"
                 "Boost|Boost::headers|Boost|libboost-dev"
                 "nlohmann_json|nlohmann_json::nlohmann_json|JSON for Modern C++|nlohmann-json3-dev"
                 "Random123|Random123::Random123|Random123|librandom123-dev")
    if(component STREQUAL "mpi")
      list(APPEND packages "MPI|MPI::MPI_CXX|Open MPI or another MPI|libopenmpi-dev")
    endif()
  else()
    set(${missing} "there is no component '${component}'; the components are: ceres, cvode, campaign, mpi" PARENT_SCOPE)
    return()
  endif()

  set(found_targets "")
  foreach(package IN LISTS packages)
    string(REPLACE "|" ";" fields "${package}")
    list(GET fields 0 name)
    list(GET fields 1 target)
    list(GET fields 2 title)
    list(GET fields 3 debian)
    if(NOT TARGET ${target})
      jml_find_package(${name})
    endif()
    # Without a version range in find_package: SUNDIALS' own version file refuses one across two major versions.
    set(version ${${name}_VERSION})
    if(name STREQUAL "SUNDIALS" AND version MATCHES "^[0-9]" AND (version VERSION_LESS 6.4 OR version VERSION_GREATER_EQUAL 8))
      set(${missing} "component ${component} needs ${title}, and found ${version} in ${${name}_DIR}" PARENT_SCOPE)
      return()
    endif()
    if(NOT TARGET ${target})
      set(${missing} "component ${component} needs ${title}, which was not found: install it (Debian, Ubuntu: ${debian})"
          PARENT_SCOPE)
      return()
    endif()
    list(APPEND found_targets ${target})
  endforeach()
  set(${targets} ${found_targets} PARENT_SCOPE)
endfunction()

# find_package with what each package needs besides its name. A macro: its variables are the caller's.
macro(jml_find_package name)
  set(CMAKE_MESSAGE_LOG_LEVEL WARNING)  # some configurations talk even where they are asked not to
  if(${name} STREQUAL "SUNDIALS")
    find_package(SUNDIALS QUIET COMPONENTS cvode nvecserial sunmatrixdense sunlinsoldense sunnonlinsolfixedpoint)
    # SUNDIALS 7 built with MPI links MPI::MPI_C, which is made only in projects that have language C.
    if(TARGET MPI::MPI_CXX AND NOT TARGET MPI::MPI_C)
      add_library(MPI::MPI_C INTERFACE IMPORTED)
      target_link_libraries(MPI::MPI_C INTERFACE MPI::MPI_CXX)
    endif()
  elseif(${name} STREQUAL "Random123")  # headers alone, without a configuration
    find_path(JML_RANDOM123_INCLUDE_DIR Random123/philox.h)
    mark_as_advanced(JML_RANDOM123_INCLUDE_DIR)
    if(JML_RANDOM123_INCLUDE_DIR)
      add_library(Random123::Random123 INTERFACE IMPORTED)
      target_include_directories(Random123::Random123 INTERFACE ${JML_RANDOM123_INCLUDE_DIR})
    endif()
  elseif(${name} STREQUAL "Boost")
    find_package(Boost QUIET CONFIG)
  elseif(${name} STREQUAL "MPI")
    find_package(MPI QUIET COMPONENTS CXX)
  else()
    find_package(${name} QUIET)
  endif()
  unset(CMAKE_MESSAGE_LOG_LEVEL)
endmacro()
