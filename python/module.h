// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace cgs {

// One function per group of names: adds them to the module. A type is added before what takes it.
void add_errors(pybind11::module_& module);
void add_cameras(pybind11::module_& module);
void add_scenes(pybind11::module_& module);
void add_meshes(pybind11::module_& module);
void add_splats(pybind11::module_& module);
void add_volumes(pybind11::module_& module);
void add_models(pybind11::module_& module);
void add_program(pybind11::module_& module);

}  // namespace cgs
