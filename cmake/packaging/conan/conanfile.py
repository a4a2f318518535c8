# SPDX-License-Identifier: BSD-3-Clause
# conan create cmake/packaging/conan [-o "&:system_eigen=True"]: the package of this source tree, and its test package.
import os
import re

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir


class JmlConan(ConanFile):
    name = "jml"
    description = "Nonlinear state estimators for flight and guidance code, header-only C++20 on Eigen"
    license = "BSD-3-Clause"
    topics = ("kalman-filter", "estimation", "eigen", "header-only")
    package_type = "header-library"
    settings = "os", "compiler", "build_type", "arch"
    # system_eigen: the Eigen that CMake finds on the machine, and not Conan's.
    options = {"system_eigen": [True, False]}
    default_options = {"system_eigen": False}
    no_copy_source = True

    @property
    def _root(self):
        return os.path.join(self.recipe_folder, os.pardir, os.pardir, os.pardir)

    def set_version(self):
        text = load(self, os.path.join(self._root, "CMakeLists.txt"))
        self.version = re.search(r"project\(jml VERSION ([0-9.]+)", text).group(1)

    def export_sources(self):
        for part in ("CMakeLists.txt", "LICENSE", "include/*", "cmake/*.cmake", "cmake/*.in"):
            copy(self, part, self._root, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        if not self.options.system_eigen:
            self.requires("eigen/[>=3.4.0 <6]", transitive_headers=True)

    def validate(self):
        check_min_cppstd(self, 20)

    def generate(self):
        toolchain = CMakeToolchain(self)
        for part in ("TESTS", "EXAMPLES", "BENCHMARKS"):
            toolchain.cache_variables["JML_BUILD_" + part] = False
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        rmdir(self, os.path.join(self.package_folder, "share", "doc"))

    def package_id(self):
        self.info.clear()

    def package_info(self):
        # find_package(jml) reads the package's own configuration, as after cmake --install: it finds Eigen, and has the
        # components. Other generators get the headers and what they need.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = [os.path.join("share", "cmake", "jml")]
        self.cpp_info.set_property("pkg_config_name", "jml")
        self.cpp_info.bindirs = []
        self.cpp_info.libdirs = []
        if not self.options.system_eigen:
            self.cpp_info.requires = ["eigen::eigen"]
