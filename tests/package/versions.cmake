# SPDX-License-Identifier: BSD-3-Clause
# The version stands in CMakeLists.txt; what packages say of it besides must agree with that, and the licence too.
function(check file pattern)
  file(READ ${SOURCE}/${file} text)
  if(NOT text MATCHES "${pattern}")
    message(SEND_ERROR "${file} does not say ${pattern}")
  endif()
endfunction()
string(REPLACE "." "[.]" version ${VERSION})
check(CITATION.cff "\nversion: ${version}\n")
check(CITATION.cff "\nlicense: BSD-3-Clause\n")
check(cmake/packaging/vcpkg/ports/jml/vcpkg.json "\"version\": \"${version}\"")
check(cmake/packaging/debian/changelog "^jml [(]${version}[+-]")
check(CHANGELOG.md "\n(## \\[${version}\\]|Of version ${version}, which has not been released)")
