# SPDX-License-Identifier: BSD-3-Clause
# cmake -DROOT=… -DDEMOS=a,b,… -P demo_index.cmake: writes <ROOT>/index.html, one static page with the tables and figures
# of the demos that have run, from what each left in its directory: console.txt, *.svg, and beside each picture its
# title and caption as text.
cmake_policy(SET CMP0007 NEW)
string(REPLACE "," ";" demos "${DEMOS}")

function(escape text out)
  string(REPLACE "&" "&amp;" text "${text}")
  string(REPLACE "<" "&lt;" text "${text}")
  string(REPLACE ">" "&gt;" text "${text}")
  string(REPLACE "\"" "&quot;" text "${text}")
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

set(contents "")
set(body "")
foreach(demo IN LISTS demos)
  set(directory ${ROOT}/${demo})
  if(NOT EXISTS ${directory}/summary.csv)
    continue()
  endif()
  string(APPEND contents "<li><a href=\"#${demo}\">${demo}</a></li>\n")
  string(APPEND body "<h2 id=\"${demo}\">${demo}</h2>\n")
  if(EXISTS ${directory}/console.txt)
    file(READ ${directory}/console.txt printed)
    escape("${printed}" printed)
    string(APPEND body "<pre>${printed}</pre>\n")
  endif()
  set(links "<a href=\"${demo}/summary.csv\">summary.csv</a>")
  file(GLOB pages RELATIVE ${directory} ${directory}/*.md)
  foreach(page IN LISTS pages)
    string(APPEND links ", <a href=\"${demo}/${page}\">${page}</a>")
  endforeach()
  string(APPEND body "<p>All figures as numbers: ${links}</p>\n")
  file(GLOB pictures RELATIVE ${directory} ${directory}/*.svg)
  list(SORT pictures COMPARE NATURAL)
  foreach(picture IN LISTS pictures)
    string(REGEX REPLACE "svg$" "txt" words ${picture})
    set(caption "")
    if(EXISTS ${directory}/${words})
      file(READ ${directory}/${words} caption)
      string(STRIP "${caption}" caption)
      escape("${caption}" caption)
      string(REGEX REPLACE "^([^\n]*)\n" "<b>\\1.</b> " caption "${caption}")
    endif()
    string(APPEND body "<figure><img src=\"${demo}/${picture}\" alt=\"${demo}, ${picture}\">"
           "<figcaption>${caption}</figcaption></figure>\n")
  endforeach()
endforeach()

file(WRITE ${ROOT}/index.html "<!DOCTYPE html>
<html lang=\"en\"><head><meta charset=\"utf-8\"><title>jml: demos</title>
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<style>
body { font: 16px/1.45 Helvetica, Arial, sans-serif; max-width: 1000px; margin: 2em auto; padding: 0 1em; color: #111 }
pre { background: #f5f5f5; padding: 0.8em; overflow-x: auto; font: 13px/1.35 'DejaVu Sans Mono', monospace }
figure { margin: 1.5em 0 } img { max-width: 100%; border: 1px solid #ccc }
figcaption { font-size: 15px } h2 { margin-top: 2.5em; border-bottom: 1px solid #999 }
</style></head><body>
<h1>jml: what the demos print and draw</h1>
<p>Each caption says which figure of which source a picture redraws, and of which filter. Units are in brackets; (-) is a
number. Colours are those of Okabe and Ito, told apart by the common kinds of colour blindness as well.</p>
<ul>
${contents}</ul>
${body}</body></html>
")
message("All of it on one page: ${ROOT}/index.html")
