#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <optional>

#include "bsp2/bsp2.hpp"

namespace bsp2::python {

namespace py = pybind11;

/// Python's other threads go on, and what the library does ends when a signal wants to be raised.
class Released {
 public:
  Released() : stoppable_(is_over) {}
  /// What came when all was done is raised by Python itself.
  ~Released() {  // NOLINT(bugprone-exception-escape): there is an interpreter
    if (!raised || std::uncaught_exceptions() > exceptions_) return;
    const py::gil_scoped_acquire gil;
    raised.reset();
    PyErr_SetInterrupt();
  }
  Released(const Released&) = delete;
  Released& operator=(const Released&) = delete;

  /// Of a call that has ended by it, until its exception is translated.
  inline static thread_local std::optional<py::error_already_set> raised;

 private:
  int exceptions_ = (raised.reset(), std::uncaught_exceptions());  // what an earlier call has left is over
  const py::gil_scoped_release nothing_of_python_;
  const Stoppable stoppable_;

  static bool is_over() {
    if (raised) return true;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() == 0) return false;
    raised.emplace();
    return true;
  }
};

}  // namespace bsp2::python
