#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <bsp2/bsp2.hpp>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace bsp2::python {

/// Whether a number is a real one, so that it becomes a double without losing a part of it: not a complex
/// one, a date, a masked one or a text, of all of which numpy makes a double if it is asked to.
inline bool is_real(pybind11::handle given) {
  if (PyFloat_Check(given.ptr()) != 0 || PyLong_Check(given.ptr()) != 0) return true;
  if (PyComplex_Check(given.ptr()) != 0 || PyNumber_Check(given.ptr()) == 0) return false;
  if (!pybind11::hasattr(given, "dtype"))  // a Fraction, a Decimal, ...
    return pybind11::hasattr(given, "__float__") || PyIndex_Check(given.ptr()) != 0;
  const auto kind = pybind11::str(given.attr("dtype").attr("kind")).cast<std::string>();
  return (kind == "b" || kind == "i" || kind == "u" || kind == "f") && !pybind11::hasattr(given, "mask");
}

}  // namespace bsp2::python

namespace pybind11::detail {

/// As pybind11 has it, but for what `is_real` refuses.
template <>
class type_caster<double> {
 public:
  PYBIND11_TYPE_CASTER(double, const_name("float"));
  bool load(handle given, bool convert) {
    if (!given || (!convert && PyFloat_Check(given.ptr()) == 0) || !bsp2::python::is_real(given))
      return false;
    value = PyFloat_AsDouble(given.ptr());
    if (PyErr_Occurred() == nullptr) return true;
    PyErr_Clear();
    return false;
  }
  static handle cast(double number, return_value_policy, handle) { return PyFloat_FromDouble(number); }
};

/// Whole numbers: a float is none, of whatever kind, and what is too large is refused.
template <typename Whole>
class WholeCaster {
 public:
  PYBIND11_TYPE_CASTER(Whole, const_name("int"));
  bool load(handle given, bool) {
    if (!given || PyIndex_Check(given.ptr()) == 0) return false;
    const auto index = reinterpret_steal<object>(PyNumber_Index(given.ptr()));
    int overflow = 0;
    const long long number = index ? PyLong_AsLongLongAndOverflow(index.ptr(), &overflow) : -1;
    if (PyErr_Occurred() != nullptr) PyErr_Clear();
    if (!index || overflow != 0 || !std::in_range<Whole>(number)) return false;
    value = static_cast<Whole>(number);
    return true;
  }
  static handle cast(Whole number, return_value_policy, handle) {
    if constexpr (std::is_signed_v<Whole>) return PyLong_FromLongLong(number);
    return PyLong_FromUnsignedLongLong(static_cast<unsigned long long>(number));
  }
};
template <>
class type_caster<int> : public WholeCaster<int> {};
template <>
class type_caster<unsigned> : public WholeCaster<unsigned> {};
template <>
class type_caster<unsigned long> : public WholeCaster<unsigned long> {};

}  // namespace pybind11::detail

namespace bsp2::python {

namespace py = pybind11;

/// Whether numbers of this kind become doubles without a word: not complex ones, dates, texts or objects.
inline bool is_of_numbers(const py::array& array) {
  if (py::hasattr(array, "mask")) return false;  // what is masked has a number, too, that means nothing
  const char kind = array.dtype().kind();
  return kind == 'b' || kind == 'i' || kind == 'u' || kind == 'f';
}

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// An array as it is, which may be one with a mask; of lists a new one.
inline py::array array_of_given(const py::object& given) {
  if (py::isinstance<py::array>(given)) return py::reinterpret_borrow<py::array>(given);
  if (py::isinstance<py::list>(given) || py::isinstance<py::tuple>(given))
    for (const py::handle item : given)
      if (!PyList_CheckExact(item.ptr()) && !PyTuple_CheckExact(item.ptr()) && py::hasattr(item, "mask"))
        return {};  // numpy would take what is masked for numbers
  return py::array::ensure(given);
}

/// Lists or an array as rows of numbers. @param name for messages.
inline Doubles rows_of(const py::object& given, const char* name) {
  const py::array array = array_of_given(given);
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

inline bool is_of_indices(const py::array& array) {
  if (py::hasattr(array, "mask")) return false;
  const char kind = array.dtype().kind();
  return kind == 'i' || kind == 'u' || (array.size() == 0 && kind == 'f');  // as numpy has an empty list
}

/// Rows of three indices. @param name for messages.
inline std::vector<std::uint32_t> triangles_of(const py::object& given, const char* name) {
  const py::array array = array_of_given(given);
  if (!array || !is_of_indices(array)) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + " have to be an array of whole numbers, or lists of them");
  }
  if (array.ndim() != 2 || array.shape(1) != 3)
    throw py::value_error(std::string(name) + " are m x 3 numbers");
  // Above 2^63 they come out negative.
  const auto numbers = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>::ensure(array);
  std::vector<std::uint32_t> indices;
  indices.reserve(static_cast<std::size_t>(numbers.size()));
  for (py::ssize_t i = 0; i < numbers.size(); ++i) {
    const std::int64_t index = numbers.data()[i];
    if (index < 0 || index > std::numeric_limits<std::uint32_t>::max())
      throw py::value_error(std::string(name) + ": " + std::to_string(index) + " is no index of a point");
    indices.push_back(static_cast<std::uint32_t>(index));
  }
  return indices;
}

/// Indices, as lists of lists or an array of two dimensions.
inline std::vector<std::vector<std::uint32_t>> indices_of(const py::object& given) {
  if (py::isinstance<py::array>(given) && !is_of_indices(py::reinterpret_borrow<py::array>(given)))
    throw py::type_error("indices have to be whole numbers");
  return given.is_none() ? std::vector<std::vector<std::uint32_t>>()
                         : given.cast<std::vector<std::vector<std::uint32_t>>>();
}

/// One more level of lists in lists, as Python counts them: one that holds itself ends with a RecursionError.
class Level {
 public:
  Level() {
    if (Py_EnterRecursiveCall(" in a list of values") != 0) throw py::error_already_set();
  }
  ~Level() { Py_LeaveRecursiveCall(); }
  Level(const Level&) = delete;
  Level& operator=(const Level&) = delete;
};

/// Python's or numpy's, which has had two names.
inline bool is_bool(const py::handle& given) {
  const char* type = Py_TYPE(given.ptr())->tp_name;
  return PyBool_Check(given.ptr()) != 0 || std::strcmp(type, "numpy.bool_") == 0 ||
         std::strcmp(type, "numpy.bool") == 0;
}

/// Any value as that of an argument of a node.
inline Value value_of(const py::handle& given) {
  if (is_bool(given)) return Value(given.cast<bool>());
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
  const bool is_one_of_numpy = py::hasattr(given, "dtype");  // a record would be a sequence, too
  if (PySequence_Check(given.ptr()) != 0 && PyBytes_Check(given.ptr()) == 0 && !is_one_of_numpy) {
    const Level level;
    std::vector<Value> list;
    for (const py::handle item : py::reinterpret_borrow<py::sequence>(given)) list.push_back(value_of(item));
    return Value(list);
  }
  if (is_real(given)) return Value(given.cast<double>());
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
