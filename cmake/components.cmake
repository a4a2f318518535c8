# SPDX-License-Identifier: BSD-3-Clause
# The optional components. Read by jml's own build and, installed as jmlComponents.cmake, by find_package(jml).

# jml_find_component(<component> <targets> <missing>): sets <targets> to what jml::<component> links besides jml::jml;
# or sets it empty, and <missing> to what is missing. A function, so that the packages' variables stay in here.
function(jml_find_component component targets missing)
  set(${targets} "" PARENT_SCOPE)
  set(from "")
  set(parts "")
  if(component STREQUAL "ceres")
    set(package Ceres)
    set(title "Ceres Solver")
    set(debian libceres-dev)
    set(found_targets Ceres::ceres)
  elseif(component STREQUAL "cvode")
    set(package SUNDIALS)
    set(title "SUNDIALS 6.4 to 7")
    set(debian libsundials-dev)
    set(from 6.4)
    set(below 8)
    set(parts cvode nvecserial sunmatrixdense sunlinsoldense sunnonlinsolfixedpoint)
    list(TRANSFORM parts PREPEND SUNDIALS:: OUTPUT_VARIABLE found_targets)
  else()
    set(${missing} "there is no component '${component}'; the components are: ceres, cvode" PARENT_SCOPE)
    return()
  endif()

  list(GET found_targets 0 first)
  if(NOT TARGET ${first})
    set(CMAKE_MESSAGE_LOG_LEVEL WARNING)  # some configurations talk even where they are asked not to
    find_package(${package} QUIET COMPONENTS ${parts})
    # SUNDIALS 7 built with MPI links MPI::MPI_C, which is made only in projects that have language C.
    if(TARGET MPI::MPI_CXX AND NOT TARGET MPI::MPI_C)
      add_library(MPI::MPI_C INTERFACE IMPORTED)
      target_link_libraries(MPI::MPI_C INTERFACE MPI::MPI_CXX)
    endif()
  endif()
  # Without a version range in find_package: SUNDIALS' own version file refuses one across two major versions.
  set(version ${${package}_VERSION})
  if(from AND version MATCHES "^[0-9]" AND (version VERSION_LESS from OR version VERSION_GREATER_EQUAL below))
    set(${missing} "component ${component} needs ${title}, and found ${version} in ${${package}_DIR}" PARENT_SCOPE)
    return()
  endif()
  foreach(target IN LISTS found_targets)
    if(NOT TARGET ${target})
      set(${missing} "component ${component} needs ${title}, which was not found: install it (Debian, Ubuntu: ${debian})"
          PARENT_SCOPE)
      return()
    endif()
  endforeach()
  set(${targets} ${found_targets} PARENT_SCOPE)
endfunction()
