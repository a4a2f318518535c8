# SPDX-License-Identifier: BSD-3-Clause
# The contenders of the contests n2, n6, n15 (filters.json).
foreach(n 2 6 15)
  peer_contender(nothing-n${n} nothing.cpp DEFINE JML_PEER_N=${n})
  peer_contender(loops_ekf-n${n} loops.cpp DEFINE JML_PEER_N=${n})
  peer_contender(loops_jml-n${n} loops.cpp DEFINE JML_PEER_N=${n} JML_PEER_LOOPS_JML)
  peer_contender(eigen_ekf-n${n} eigen_ekf.cpp DEFINE JML_PEER_N=${n})
  set(method 1)
  foreach(name jml_ekf jml_factored_ekf jml_one_pass jml_iterated)
    peer_contender(${name}-n${n} jml_filter.cpp DEFINE JML_PEER_N=${n} JML_PEER_METHOD=${method})
    math(EXPR method "${method} + 1")
  endforeach()
endforeach()
