# SPDX-License-Identifier: BSD-3-Clause
# cmake -DFOLDER=<include> -DVERSION=<of jml> -DLICENSE=<file> -DOUTPUT=<folder> -P single_header.cmake: writes
# <OUTPUT>/jml/jml.hpp, jml/jml.hpp and what it includes in one file that needs Eigen alone; and <OUTPUT>/headers.txt,
# which headers are in it.
cmake_minimum_required(VERSION 3.25)
set(order "")    # headers, each after all that it includes
set(standard "")  # of the compiler and of Eigen

function(take header)
  if(header IN_LIST order)
    return()
  endif()
  if(header IN_LIST on_the_way)
    message(FATAL_ERROR "${header} includes itself: ${on_the_way}")
  endif()
  list(APPEND on_the_way ${header})
  file(READ ${FOLDER}/${header} text)
  string(REGEX MATCHALL "\n#include <[^>\n]*>" includes "${text}")
  list(TRANSFORM includes REPLACE "\n#include <([^>\n]*)>" "\\1")
  foreach(included IN LISTS includes)
    if(NOT included MATCHES "^jml/")
      list(APPEND standard ${included})
    elseif(NOT included MATCHES "^jml/warnings_(begin|end).hpp$")
      take(${included})
    endif()
  endforeach()
  list(APPEND order ${header})
  set(order "${order}" PARENT_SCOPE)
  set(standard "${standard}" PARENT_SCOPE)
endfunction()
take(jml/jml.hpp)

# A header's own text: without the licence line that all have, its includes, and empty lines at its ends.
function(body_of header out)
  file(READ ${FOLDER}/${header} text)
  string(REGEX REPLACE "^// SPDX-License-Identifier: BSD-3-Clause\n" "\n" text "${text}")
  string(REPLACE "\n#pragma once\n" "\n" text "${text}")
  string(REGEX REPLACE "\n#include <[^\n]*" "" text "${text}")
  string(REGEX REPLACE "\n(/// @file\n)" "\n" text "${text}")
  string(REGEX REPLACE "\n\n\n+" "\n\n" text "${text}")
  string(REGEX REPLACE "^\n+" "" text "${text}")
  string(REGEX REPLACE "\n+$" "" text "${text}")
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

list(REMOVE_DUPLICATES standard)
list(SORT standard)
file(READ ${LICENSE} license)
string(REGEX REPLACE "\n$" "" license "${license}")
string(REGEX REPLACE "\n" "\n// " license "// ${license}")
string(REGEX REPLACE "// \n" "//\n" license "${license}")
body_of(jml/warnings_begin.hpp begin)
body_of(jml/warnings_end.hpp end)
string(REGEX REPLACE "^(//[^\n]*\n)+" "" begin "${begin}")
string(REGEX REPLACE "^(//[^\n]*\n)+" "" end "${end}")

set(one "// SPDX-License-Identifier: BSD-3-Clause
// jml ${VERSION}: what needs Eigen 3.4 or newer alone, in one file. C++20 or later. Generated: change the headers it is made of.
//
${license}
#pragma once

")
foreach(header IN LISTS standard)
  string(APPEND one "#include <${header}>\n")
endforeach()
string(APPEND one "\n${begin}\n")
foreach(header IN LISTS order)
  body_of(${header} text)
  string(APPEND one "\n// ---- ${header}\n${text}\n")
endforeach()
string(APPEND one "\n${end}\n")
string(REGEX MATCH "\n#include [<\"]jml/[^\n]*" left "${one}")
if(left)
  message(FATAL_ERROR "an include of jml is left: ${left}")
endif()
file(WRITE ${OUTPUT}/jml/jml.hpp "${one}")
list(JOIN order "\n" order)
file(WRITE ${OUTPUT}/headers.txt "${order}\n")
message("${OUTPUT}/jml/jml.hpp")
