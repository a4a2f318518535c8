// SPDX-License-Identifier: BSD-3-Clause
// Nothing but what the precompiled headers of the tests are compiled with; see tests/CMakeLists.txt.
