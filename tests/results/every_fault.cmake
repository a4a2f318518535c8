# SPDX-License-Identifier: BSD-3-Clause
# cmake -DQUOTED=… -DCOLLECT=… -DDIRECTORY=… -P every_fault.cmake: a small repository whose page is right, and every way in
# which it could be wrong; and a stored result against what is printed.
set(page "# Page
The EKF is off by 0.89 m,
and JML by 172 m; noise of 0.05 m.

| rule | error |
|---|---|
| `Factored{Ekf{}}` | 12 346 |
| ratio | 1.50 |
| least | 50.0 |
")
set(results "name,value,unit\nekf,0.8871459,m\njml,172.12,m\nlong,12345.6,m\nhalf,8230.4,m\n")
set(list "[page.md whole]
The EKF is off by {plaza:ekf .2} m, and JML by {plaza:jml .0} m;
given: noise of 0.05 m
| `Factored{Ekf{}}` | {plaza:long .0} |
| ratio | {plaza:long / plaza:half .2} |
| least | {100 * plaza:half / plaza:long max plaza:half * plaza:long min 0.75 .1} |
")
set(wrong 0)

function(expect_quoted code saying what)
  file(WRITE ${DIRECTORY}/page.md "${page}")
  file(WRITE ${DIRECTORY}/examples/guide/results/plaza.csv "${results}")
  file(WRITE ${DIRECTORY}/examples/guide/results/quoted.txt "${list}")
  execute_process(COMMAND ${QUOTED} check ${DIRECTORY} OUTPUT_VARIABLE said RESULT_VARIABLE result)
  string(FIND "${said}" "${saying}" found)
  if(NOT result EQUAL ${code} OR found EQUAL -1)
    message("${what}: exit code ${result}, and it said\n${said}")
    math(EXPR wrong "${wrong} + 1")
    set(wrong ${wrong} PARENT_SCOPE)
  endif()
endfunction()

# expect_fault(<variable> <what it has> <what it has instead> <what is said>)
macro(expect_fault variable from to saying)
  set(right "${${variable}}")
  string(REPLACE "${from}" "${to}" ${variable} "${right}")
  if("${${variable}}" STREQUAL "${right}")
    message(FATAL_ERROR "there is no ${from}")
  endif()
  expect_quoted(1 "${saying}" "${from} -> ${to}")
  set(${variable} "${right}")
endmacro()

expect_quoted(0 "5 pieces of 1 pages" "the page as it is right")
expect_fault(page "0.89" "0.88" "says 0.88, the stored result is 0.89")
expect_fault(page "0.89" "0.887" "says 0.887, the stored result is 0.89")
expect_fault(page "172" "17" "says 17, the stored result is 172")
expect_fault(page "12 346" "12 345" "says 12 345, the stored result is 12 346")
expect_fault(page "1.50" "1.49" "says 1.49, the stored result is 1.50")
expect_fault(page "off by" "away by" "does not say: The EKF")
expect_fault(page "| ratio |" "| quotient |" "does not say: | ratio")
expect_fault(page "| ratio |" "| quotient |" "has a row that is no stored result: | quotient")
expect_fault(page "1.50 |" "1.50 | 2 |" "does not say: | ratio")
expect_fault(page "0.05" "0.06" "does not say: given: noise of 0.05")
expect_fault(page "# Page" "Page of 0.7 m" "has a number that is no stored result: 0.7")
expect_fault(page "1.50 |" "1.50 |\n| more | 3 |" "has a row that is no stored result: | more")
expect_fault(page "| ratio | 1.50 |" "| ratio | 1.50 |\n| ratio | 1.50 |" "says more than once")
expect_fault(results "0.8871459" "0.8971459" "says 0.89, the stored result is 0.90")
expect_fault(results "jml,172.12,m\n" "" "no stored result plaza:jml")
expect_fault(results "name,value,unit" "name,value" "no stored result plaza:ekf")
expect_fault(list "plaza:ekf .2" "plaza:ekf .3" "says 0.89, the stored result is 0.887")
expect_fault(list "given: noise" "noise" "neither a result nor given")
expect_fault(list "[page.md" "[other.md" "other.md cannot be read")

# Code is not looked at; of a page of which decimals alone are asked, rows of tables without them are not either.
string(REPLACE "# Page" "# Page\n```cpp\nx = 0.7;\n```" page "${page}")
expect_quoted(0 "5 pieces of 1 pages" "code in the page")
expect_fault(page "```cpp" "" "has a number that is no stored result: 0.7")
string(REPLACE "whole]" "decimals]" list "${list}")
string(APPEND page "| rows | 7 |\n")
expect_quoted(0 "5 pieces of 1 pages" "a page of decimals")
expect_fault(page "| 7 |" "| 7.5 |" "has a number that is no stored result: 7.5")
expect_fault(page "# Page" "Page of 0.9 m" "has a number that is no stored result: 0.9")

# What stands in another file is to stand there.
file(WRITE ${DIRECTORY}/source.md "there is noise of 0.05 m")
string(REPLACE "given: noise" "given by source.md: noise" list "${list}")
expect_quoted(0 "5 pieces of 1 pages" "quoted from another file")
expect_fault(list "by source.md" "by nothing.md" "quotes what is not there: given by nothing.md")
expect_fault(list "source.md:" "source.md after there was :" "quotes what is not there: given by source.md after there was")
string(REPLACE "source.md:" "source.md after there is :" list "${list}")
expect_quoted(0 "5 pieces of 1 pages" "quoted from another file behind words")
file(WRITE ${DIRECTORY}/source.md "there is noise of 0.06 m")
expect_quoted(1 "quotes what is not there: given by source.md" "another file that says another thing")
file(WRITE ${DIRECTORY}/source.md "there is noise of 0.05 m")

# What is wrong is mended by `write`.
string(REPLACE "0.89" "0.12" page "${page}")
expect_quoted(1 "0.12" "before it is mended")
execute_process(COMMAND ${QUOTED} write ${DIRECTORY} OUTPUT_QUIET RESULT_VARIABLE result)
file(READ ${DIRECTORY}/page.md mended)
string(REPLACE "0.12" "0.89" page "${page}")
if(NOT result EQUAL 0 OR NOT mended STREQUAL page)
  message("not mended:\n${mended}")
  math(EXPR wrong "${wrong} + 1")
endif()

# A stored result against what is printed now.
file(WRITE ${DIRECTORY}/stored.csv "${results}")
function(expect_collect code from to)
  string(REPLACE "${from}" "${to}" fresh "${results}")
  file(WRITE ${DIRECTORY}/fresh.csv "${fresh}")
  execute_process(COMMAND ${COLLECT} compare ${DIRECTORY}/stored.csv summary ${DIRECTORY}/fresh.csv OUTPUT_VARIABLE said
                  RESULT_VARIABLE result)
  if(NOT result EQUAL ${code})
    message("${from} -> ${to}: exit code ${result}, and it said\n${said}")
    math(EXPR wrong "${wrong} + 1")
    set(wrong ${wrong} PARENT_SCOPE)
  endif()
endfunction()
expect_collect(0 "m" "m")
expect_collect(0 "172.12" "172.1200001")
expect_collect(1 "172.12" "172.2")
expect_collect(1 "172.12" "nan")
expect_collect(1 "jml,172.12,m\n" "")
expect_collect(1 "jml,172.12,m\n" "jml,172.12,m\nmore,1,m\n")
expect_collect(1 "name,value" "value,name")

if(wrong)
  message(FATAL_ERROR "${wrong} faults are not found as they should be")
endif()
