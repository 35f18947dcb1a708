// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <filesystem>
#include <string>

#include "python/module.h"
#include <CLI/App.hpp>

#include "convert/text/advice.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace py = pybind11;

// The exceptions, by the exit code of the program. They live as long as the module.
struct Exceptions {
  PyObject* any = nullptr;
  PyObject* invalid_input = nullptr;
  PyObject* bad_input = nullptr;
  PyObject* limit = nullptr;
  PyObject* io = nullptr;
  PyObject* numerical = nullptr;
};
Exceptions exceptions;

PyObject* add_exception(py::module_& module, const char* name, const char* doc, py::tuple bases) {
  const std::string full = std::string("cgs.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases.ptr(), nullptr);
  if (type == nullptr) throw py::error_already_set();
  module.attr(name) = py::handle(type);
  return type;
}

// Raises an exception with attributes of its own.
void raise(PyObject* type, const Error& error) {
  const auto class_of = py::reinterpret_borrow<py::object>(type);
  const py::object raised = class_of(words_of(error));
  py::setattr(raised, "exit_code", py::int_(error.exit_code()));
  if (const auto* bad = dynamic_cast<const BadInput*>(&error)) {
    py::setattr(raised, "defect", py::str(std::string(defect_name(bad->defect()))));
  }
  PyErr_SetObject(type, raised.ptr());
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const Cancelled&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  } catch (const InvalidInput& error) {
    raise(exceptions.invalid_input, error);
  } catch (const BadInput& error) {
    raise(exceptions.bad_input, error);
  } catch (const LimitError& error) {
    raise(exceptions.limit, error);
  } catch (const IoError& error) {
    raise(exceptions.io, error);
  } catch (const NumericalError& error) {
    raise(exceptions.numerical, error);
  } catch (const Error& error) {
    raise(exceptions.any, error);
  } catch (const std::filesystem::filesystem_error& error) {
    raise(exceptions.io, IoError(error.path1(), error.code().message()));
  }
}

}  // namespace

void add_errors(py::module_& module) {
  const auto base = py::reinterpret_borrow<py::object>(PyExc_Exception);
  const auto with = [](PyObject* ours, PyObject* usual) {
    return py::make_tuple(py::reinterpret_borrow<py::object>(ours),
                          py::reinterpret_borrow<py::object>(usual));
  };
  exceptions.any = add_exception(module,
                                 "Error",
                                 "What all exceptions of this module are; exit_code is that of the "
                                 "program.",
                                 py::make_tuple(base));
  exceptions.invalid_input = add_exception(module,
                                           "InvalidInput",
                                           "An argument cannot be used.",
                                           with(exceptions.any, PyExc_ValueError));
  exceptions.bad_input = add_exception(module,
                                       "BadInput",
                                       "A file or data set cannot be used; `defect` says in a word "
                                       "what is wrong: TRUNCATED, MISSING, VALUE ...",
                                       with(exceptions.any, PyExc_ValueError));
  exceptions.limit = add_exception(module,
                                   "LimitError",
                                   "A size or a predicted cost is above a limit.",
                                   with(exceptions.any, PyExc_MemoryError));
  exceptions.io = add_exception(
      module, "IoError", "The file system refused.", with(exceptions.any, PyExc_OSError));
  exceptions.numerical = add_exception(module,
                                       "NumericalError",
                                       "There is no finite answer for this input.",
                                       with(exceptions.any, PyExc_ArithmeticError));
  py::register_exception_translator(translate);
}

}  // namespace cgs
