#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <bsp2/bsp2.hpp>
#include <string>
#include <vector>

namespace bsp2::python {

namespace py = pybind11;

/// Whether numbers of this kind become doubles without a word: not complex ones, dates, texts or objects.
inline bool is_of_numbers(const py::array& array) {
  const char kind = array.dtype().kind();
  return kind == 'b' || kind == 'i' || kind == 'u' || kind == 'f';
}

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Lists or an array as rows of numbers. @param name for messages.
inline Doubles rows_of(const py::object& given, const char* name) {
  const py::array array = py::array::ensure(given);
  if (!array || !is_of_numbers(array)) {
    PyErr_Clear();
    throw py::type_error(std::string(name) +
                         " has to be an array of numbers, or lists of them, all of one length");
  }
  Doubles rows = Doubles::ensure(array);
  if (rows && rows.ndim() == 2 && rows.shape(1) == 0)
    throw py::value_error(std::string(name) + " has rows without numbers");
  if (!rows || rows.ndim() != 2)
    throw py::value_error(std::string(name) + " has to have two dimensions (a row for each), not " +
                          std::to_string(array.ndim()));
  return rows;
}

inline std::span<const double> span_of(const Doubles& array) {
  return {array.data(), static_cast<std::size_t>(array.size())};
}

inline std::vector<Vector> vectors_of(const py::object& given, const char* name) {
  const Doubles rows = rows_of(given, name);
  std::vector<Vector> vectors;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i)
    vectors.emplace_back(rows.data(i, 0), rows.data(i, 0) + rows.shape(1));
  return vectors;
}

/// Indices, as lists of lists or an array of two dimensions.
inline std::vector<std::vector<std::uint32_t>> indices_of(const py::object& given) {
  return given.is_none() ? std::vector<std::vector<std::uint32_t>>()
                         : given.cast<std::vector<std::vector<std::uint32_t>>>();
}

/// Any value as that of an argument of a node.
inline Value value_of(const py::handle& given) {
  if (PyBool_Check(given.ptr()) != 0) return Value(given.cast<bool>());
  if (py::isinstance<py::str>(given)) return Value(given.cast<std::string>());
  if (PyFloat_Check(given.ptr()) != 0 || PyLong_Check(given.ptr()) != 0) return Value(given.cast<double>());
  if (py::isinstance<py::array>(given)) {
    const auto array = py::reinterpret_borrow<py::array>(given);
    if (!is_of_numbers(array))
      throw py::type_error("an array of numbers is needed, not of " +
                           py::str(array.dtype()).cast<std::string>());
    if (array.ndim() == 0 || array.ndim() > 2 || array.dtype().kind() == 'b')
      return value_of(array.attr("tolist")());
    const Doubles numbers = Doubles::ensure(array);
    return array.ndim() == 1 ? Value(span_of(numbers))
                             : Value::rows(span_of(numbers), static_cast<std::size_t>(numbers.shape(1)));
  }
  if (PySequence_Check(given.ptr()) != 0) {
    std::vector<Value> list;
    for (const py::handle item : py::reinterpret_borrow<py::sequence>(given)) list.push_back(value_of(item));
    return Value(list);
  }
  if (PyNumber_Check(given.ptr()) != 0)
    return Value(py::float_(py::reinterpret_borrow<py::object>(given)).cast<double>());
  throw py::type_error("a number, a text, or lists of them are needed, not " +
                       py::str(py::type::handle_of(given)).cast<std::string>());
}

/// Keywords as arguments of a node; fn, fa, fs and what begins otherwise as the language has it.
inline Arguments arguments_of(const py::kwargs& keywords) {
  Arguments arguments;
  for (const auto& [key, value] : keywords) {
    auto name = key.cast<std::string>();
    if (value.is_none()) continue;
    if (name == "fn" || name == "fa" || name == "fs") name.insert(0, "$");
    try {
      arguments.emplace_back(name, value_of(value));
    } catch (const py::type_error& error) {
      throw py::type_error(name + ": " + error.what());
    }
  }
  return arguments;
}

/// Operands one by one, or lists of them.
inline std::vector<Expression> operands_of(const py::args& given) {
  std::vector<Expression> operands;
  for (const py::handle item : given) {
    if (py::isinstance<Expression>(item))
      operands.push_back(item.cast<Expression>());
    else if (PyIter_Check(item.ptr()) != 0 || PySequence_Check(item.ptr()) != 0)
      for (const py::handle each : py::reinterpret_borrow<py::iterable>(item))
        operands.push_back(each.cast<Expression>());
    else
      throw py::type_error("solids are needed, not " +
                           py::str(py::type::handle_of(item)).cast<std::string>());
  }
  return operands;
}

}  // namespace bsp2::python
