# SPDX-License-Identifier: BSD-3-Clause
# Each header in FOLDER begins and ends what jml/warnings_begin.hpp says of warnings.
file(GLOB_RECURSE headers ${FOLDER}/*.hpp)
set(bad "")
foreach(header IN LISTS headers)
  file(READ ${header} text)
  if(NOT header MATCHES "/warnings_(begin|end).hpp$" AND
     NOT text MATCHES "\n#include <jml/warnings_begin.hpp>\n#pragma once\n.*\n#include <jml/warnings_end.hpp>\n$")
    string(APPEND bad "  ${header}\n")
  endif()
endforeach()
if(NOT bad STREQUAL "")
  message(FATAL_ERROR "Without <jml/warnings_begin.hpp> before #pragma once, and <jml/warnings_end.hpp> as the last line:\n${bad}")
endif()
