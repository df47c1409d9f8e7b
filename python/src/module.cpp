#include <chrono>
#include <map>
#include <optional>

#include "nodes.hpp"
#include "released.hpp"

namespace bsp2::python {
namespace {

using py::arg;

/// An array that shows numbers of a result without a copy, and keeps it alive; nobody may write to it.
template <typename Number>
py::array view_of(std::span<const Number> numbers, const py::object& owner, std::size_t width = 0) {
  const auto count = static_cast<py::ssize_t>(numbers.size());
  std::vector<py::ssize_t> shape{count};
  if (width > 0) shape = {count / static_cast<py::ssize_t>(width), static_cast<py::ssize_t>(width)};
  py::array_t<Number> array(shape, numbers.data(), owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// An array that takes a vector over.
template <typename Number>
py::array array_of(std::vector<Number> numbers, std::size_t width = 0) {
  auto owned = std::make_unique<std::vector<Number>>(std::move(numbers));
  const std::span<const Number> all(*owned);
  const py::capsule owner(owned.release(),
                          [](void* made) { delete static_cast<std::vector<Number>*>(made); });
  py::array array = view_of(all, owner, width);
  py::detail::array_proxy(array.ptr())->flags |= py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::array matrix_of(const std::vector<Vector>& rows) {
  std::vector<double> flat;
  for (const Vector& row : rows) flat.insert(flat.end(), row.begin(), row.end());
  return array_of(std::move(flat), rows.empty() ? 1 : rows.size());
}

/// While the library computes, Python may have something to say: a signal, an exception of a callback.
class Listener {
 public:
  Listener(Options& options, py::object progress, py::object stop)
      : progress_(std::move(progress)), stop_(std::move(stop)) {
    if (!progress_.is_none()) options.progress = [this](const Progress& now) { tell(now); };
    options.stop = [this] { return is_over(); };
  }
  /// With the GIL, when the library has returned.
  void rethrow() {
    if (error_) {
      error_->restore();
      error_.reset();
      throw py::error_already_set();
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  py::object progress_, stop_;
  std::optional<py::error_already_set> error_;
  Clock::time_point last_{};

  template <typename Call>
  auto called(Call call) {
    const py::gil_scoped_acquire gil;
    try {
      return call();
    } catch (py::error_already_set& error) {
      error_.emplace(std::move(error));
    }
    return decltype(call())();
  }
  void tell(const Progress& now) {
    if (error_) return;
    called([&] { return progress_(now.superstep, now.done, now.cells).is_none(); });
  }
  bool is_over() {
    if (error_) return true;
    const auto now = Clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) return false;
    last_ = now;
    const bool asks_to = called([&] {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return !stop_.is_none() && py::bool_(stop_());
    });
    return asks_to || error_.has_value();
  }
};

template <typename Number>
std::optional<Number> optional_of(const py::dict& given, const char* name) {
  if (!given.contains(name) || given[name].is_none()) return std::nullopt;
  return given[name].cast<Number>();
}

Options options_of(const py::dict& given) {
  Options options;
  const auto set = [&](const char* name, auto& value) {
    using Number = std::remove_reference_t<decltype(value)>;
    if (const auto found = optional_of<Number>(given, name)) value = *found;
  };
  set("threads", options.threads);
  options.regions = optional_of<unsigned>(given, "regions");
  options.level = optional_of<unsigned>(given, "level");
  options.tolerance = optional_of<double>(given, "tolerance");
  set("size_field", options.size_field);
  options.size = optional_of<double>(given, "size");
  options.angle = optional_of<double>(given, "angle");
  set("eye", options.eye);
  if (const auto order = optional_of<std::string>(given, "order")) {
    if (*order != "depth" && *order != "priority")
      throw py::value_error("the order is 'depth' or 'priority'");
    options.order = *order == "priority" ? Order::priority : Order::depth;
  }
  options.budget = optional_of<double>(given, "budget");
  options.cells = optional_of<std::uint64_t>(given, "cells");
  set("curved", options.curved);
  set("coincidence", options.coincidence);
  set("parts_by_color", options.parts_by_colour);
  set("keep_in", options.keep_in);
  set("keep_fuzzy", options.keep_fuzzy);
  set("keep_out", options.keep_out);
  set("strict", options.strict);
  set("measures_only", options.measures_only);
  set("surface", options.surface);
  set("surface_only", options.surface_only);
  set("faces", options.faces);
  set("contacts", options.contacts);
  if (const auto path = optional_of<std::filesystem::path>(given, "snapshot")) options.snapshot = *path;
  options.timeout = optional_of<double>(given, "timeout");
  return options;
}

template <typename Made = Result, typename Work>
Made listened(Options options, const py::object& progress, const py::object& stop, Work work) {
  Listener listener(options, progress, stop);
  std::optional<Made> result;
  try {
    const py::gil_scoped_release nothing_of_python;
    result.emplace(work(options));
  } catch (const Error&) {
    listener.rethrow();
    throw;
  }
  listener.rethrow();
  return *result;
}

/// A property that shows an array of the cells.
template <typename Member>
auto cells_view(Member member, bool are_points = false) {
  return [=](const py::object& self) {
    const Cells& cells = self.cast<const Result&>().cells();
    return view_of(cells.*member, self, are_points ? static_cast<std::size_t>(cells.dimension) : 0);
  };
}

WriteOptions write_options(bool tets, std::optional<double> clean, const py::dict& look) {
  WriteOptions options{.tets = tets, .clean = clean};
  View& view = options.view;
  for (const auto& [key, value] : look) {
    const auto name = key.cast<std::string>();
    if (name == "size")
      std::tie(view.width, view.height) = value.cast<std::pair<int, int>>();
    else if (name == "shade")
      view.shade = value.cast<std::string>();
    else if (name == "edges")
      view.edges = !py::isinstance<py::bool_>(value) ? value.cast<std::string>()
                   : value.cast<bool>()              ? "cells"
                                                     : "none";
    else if (name == "legend")
      view.legend = value.cast<bool>();
    else if (name == "axes")
      view.axes = value.cast<bool>();
    else if (name == "transparent")
      view.transparent = value.cast<bool>();
    else if (name == "eye")
      view.eye = value.cast<std::optional<std::array<double, 3>>>();
    else if (name == "look")
      view.look = value.cast<std::optional<std::array<double, 3>>>();
    else if (name == "explode")
      view.explode = value.cast<double>();
    else
      throw py::type_error("a picture has no '" + name +
                           "'; size, shade, edges, legend, axes, transparent, eye, look and explode are "
                           "possible");
  }
  return options;
}

void add_measures(py::module_& m) {
  py::class_<Interval>(m, "Interval", "Between which values a number is: equal where nothing is left FUZZY.")
      .def_readonly("least", &Interval::least)
      .def_readonly("most", &Interval::most)
      .def("__iter__", [](const Interval& self) { return py::iter(py::make_tuple(self.least, self.most)); })
      .def("__contains__", [](const Interval& self, double x) { return self.least <= x && x <= self.most; })
      .def("__repr__", [](const Interval& self) {
        return "Interval(" + py::repr(py::float_(self.least)).cast<std::string>() + ", " +
               py::repr(py::float_(self.most)).cast<std::string>() + ")";
      });
  py::class_<Measures>(m, "Measures", "Integrals over a solid of dimension D, in the model's units.")
      .def_readonly("volume", &Measures::volume, "Interval: the content of dimension D.")
      .def_property_readonly(
          "centroid", [](const Measures& self) { return array_of(self.centroid); },
          "D numbers, of the IN cells.")
      .def_property_readonly(
          "inertia", [](const Measures& self) { return matrix_of(self.inertia); },
          "(D+1) x (D+1): integrals of x_i x_j with x_0 = 1, over the IN cells.")
      .def_property_readonly(
          "inertia_least", [](const Measures& self) { return matrix_of(self.inertia_least); },
          "The least that each can be; empty where nothing is FUZZY.")
      .def_property_readonly(
          "inertia_most", [](const Measures& self) { return matrix_of(self.inertia_most); },
          "The most, likewise.");
  py::class_<Part>(m, "Part", "A part of the model that has a name.")
      .def_readonly("number", &Part::number, "As in Result.parts.")
      .def_readonly("name", &Part::name)
      .def_readonly("color", &Part::color, "Red, green, blue, opacity, 0 to 255; None if it has not one.")
      .def_readonly("volume", &Part::volume, "Of its IN cells.")
      .def("__repr__",
           [](const Part& self) { return "Part(" + std::to_string(self.number) + ", '" + self.name + "')"; });
  py::class_<Surface>(
      m, "Surface",
      "The surface of the IN cells, watertight: triangles, counter-clockwise as seen from outside.")
      .def_property_readonly(
          "points",
          [](const py::object& self) { return view_of(self.cast<const Surface&>().points, self, 3); },
          "n x 3")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) { return view_of(self.cast<const Surface&>().triangles, self, 3); },
          "m x 3 indices of points")
      .def_property_readonly(
          "parts", [](const py::object& self) { return view_of(self.cast<const Surface&>().parts, self); },
          "m: the part behind each triangle")
      .def_readonly("area", &Surface::area)
      .def_readonly("closed", &Surface::closed, "Each edge is used equally often in both directions.")
      .def_readonly("digest", &Surface::digest);
  py::class_<Ranks>(m, "Ranks", "The processes that evaluate together; without arguments, this one alone.")
      .def(py::init<>())
      .def_static("launched", &Ranks::launched,
                  "All processes that a launcher (mpirun, srun) started with this one.")
      .def_property_readonly("rank", &Ranks::rank)
      .def_property_readonly("count", &Ranks::count)
      .def_property_readonly("is_master", &Ranks::is_master);
}

SolverMeshOptions solver_mesh_options(const py::dict& given) {
  SolverMeshOptions options;
  options.size = optional_of<double>(given, "size");
  options.clean = optional_of<double>(given, "clean");
  for (const auto& [name, size] : given["part_sizes"].cast<std::map<std::string, double>>())
    options.part_sizes.emplace_back(name, size);
  options.size_field = given["size_field"].cast<std::vector<std::array<double, 4>>>();
  options.growth = given["growth"].cast<double>();
  options.groups = given["groups"].cast<std::vector<std::string>>();
  options.polyhedra = given["polyhedra"].cast<bool>();
  options.dual = given["dual"].cast<bool>();
  return options;
}

DrawingOptions drawing_options(const py::dict& given) {
  DrawingOptions options;
  for (const auto& [key, value] : given) {
    const auto name = key.cast<std::string>();
    const std::map<std::string, std::string*> texts{
        {"hidden", &options.hidden},    {"smooth", &options.smooth}, {"sheet", &options.sheet},
        {"scale", &options.scale},      {"title", &options.title},   {"projection", &options.projection},
        {"author", &options.author},    {"number", &options.number}, {"date", &options.date},
        {"material", &options.material}};
    const std::map<std::string, std::vector<std::string>*> lists{
        {"views", &options.views}, {"sections", &options.sections}, {"dimensions", &options.dimensions}};
    if (const auto text = texts.find(name); text != texts.end())
      *text->second = value.cast<std::string>();
    else if (const auto list = lists.find(name); list != lists.end())
      *list->second = value.cast<std::vector<std::string>>();
    else if (name == "smooth_angle")
      options.smooth_angle = value.cast<double>();
    else if (name == "centre_lines")
      options.centre_lines = value.cast<bool>();
    else
      options.overall = value.cast<bool>();
  }
  return options;
}

void add_solver_mesh(py::module_& m) {
  m.def("_read_size_field", [](const std::string& path) { return read_size_field(path); });
  const auto shown = [](auto member, std::size_t width) {
    return [=](const py::object& self) {
      return view_of((self.cast<const SolverMesh&>().*member)(), self, width);
    };
  };
  py::class_<SolverMesh>(m, "SolverMesh",
                         "Tetrahedra that meet face to face, with names of volumes and of faces. Arrays are "
                         "views of it, as of a "
                         "result.")
      .def_property_readonly("points", shown(&SolverMesh::points, 3), "p x 3")
      .def_property_readonly("tetrahedra", shown(&SolverMesh::tetrahedra, 4),
                             "t x 4 indices of points, right side out: (b-a) x (c-a) points to d.")
      .def_property_readonly("volumes", shown(&SolverMesh::volumes, 0), "t: as in volume_names.")
      .def_property_readonly("triangles", shown(&SolverMesh::triangles, 3),
                             "s x 3: of the outside and of interfaces.")
      .def_property_readonly("groups", shown(&SolverMesh::groups, 0), "s: as in group_names.")
      .def_property_readonly("volume_names", &SolverMesh::volume_names, "Of parts; else 'solid'.")
      .def_property_readonly("group_names", &SolverMesh::group_names,
                             "By what is on the two sides ('steel|outside'), or as `groups` said.")
      .def_property_readonly("volume", &SolverMesh::volume, "Of all tetrahedra.")
      .def_property_readonly("smallest_angle", &SolverMesh::smallest_angle, "Dihedral, in degrees.")
      .def_property_readonly("largest_angle", &SolverMesh::largest_angle, "Likewise.")
      .def_property_readonly("warnings", &SolverMesh::warnings, "What is odd about it.")
      .def_property_readonly("notes", &SolverMesh::notes, "What is as it should be, but may surprise.")
      .def(
          "_write",
          [](const SolverMesh& self, const std::filesystem::path& path, bool second_order, int gmsh_version) {
            const py::gil_scoped_release nothing_of_python;
            self.write(path, second_order, gmsh_version);
          },
          arg("path"), arg("second_order"), arg("gmsh_version"));
}

py::dict located(const Result& self, const py::object& points) {
  Doubles rows = rows_of(points, "points");
  if (rows.shape(1) != self.dimension())
    throw py::value_error("points have as many numbers as the solid has dimensions: " +
                          std::to_string(self.dimension()) + ", not " + std::to_string(rows.shape(1)));
  Locations found;
  {
    const py::gil_scoped_release nothing_of_python;
    found = self.locate(span_of(rows));
  }
  py::dict all;
  all["labels"] = array_of(std::move(found.labels));
  all["primitives"] = array_of(std::move(found.primitives));
  all["parts"] = array_of(std::move(found.parts));
  all["distances"] = array_of(std::move(found.distances));
  all["nearest"] = array_of(std::move(found.nearest), static_cast<std::size_t>(self.dimension()));
  return all;
}

py::tuple contacts_of(const Result& self) {
  std::vector<Contact> contacts;
  {
    const Released nothing_of_python;
    contacts = self.contacts();
  }
  std::vector<std::uint64_t> cells;
  std::vector<std::uint16_t> faces;
  std::vector<double> areas;
  for (const Contact& each : contacts) {
    cells.insert(cells.end(), each.cell.begin(), each.cell.end());
    faces.insert(faces.end(), each.face.begin(), each.face.end());
    areas.push_back(each.area);
  }
  return py::make_tuple(array_of(std::move(cells), 2), array_of(std::move(faces), 2),
                        array_of(std::move(areas)));
}

void add_result(py::module_& m) {
  using Release = py::call_guard<Released>;
  py::class_<Result>(
      m, "Result", py::dynamic_attr(),
      "What an evaluation has found. Arrays are views of it: they keep it alive, and cannot be written to.")
      .def_property_readonly("dimension", &Result::dimension, "D, how many dimensions the solid has.")
      .def_property_readonly("complete", &Result::is_complete,
                             "Nothing is undecided but what a level leaves.")
      .def_property_readonly("interrupted", &Result::is_interrupted, "It was stopped: there are no cells.")
      .def_property_readonly("collected", &Result::is_collected,
                             "The master has all cells; else each rank its own.")
      .def_property_readonly("has_cells", &Result::has_cells, "Cells were made, and are held.")
      .def_property_readonly("_is_of_master", &Result::is_of_master)
      .def_property_readonly("digest", &Result::digest, "Of the set of cells.")
      .def_property_readonly("points", cells_view(&Cells::points, true),
                             "p x D: the corners of the cells, each cell's own.")
      .def_property_readonly("point_offsets", cells_view(&Cells::point_offset),
                             "n + 1: cell i has points[offsets[i]:offsets[i + 1]].")
      .def_property_readonly("face_offsets", cells_view(&Cells::face_offset),
                             "n + 1: cell i has faces offsets[i] to offsets[i + 1].")
      .def_property_readonly("corner_offsets", cells_view(&Cells::face_vertex_offset),
                             "f + 1: face j has corners[offsets[j]:offsets[j + 1]].")
      .def_property_readonly("corners", cells_view(&Cells::face_vertices),
                             "v: corners of faces, as indices among the points of their cell. In space "
                             "counter-clockwise as seen from outside.")
      .def_property_readonly("labels", cells_view(&Cells::labels), "n: IN, FUZZY or OUT.")
      .def_property_readonly("primitives", cells_view(&Cells::primitives),
                             "n: the primitive of the source; -1: none.")
      .def_property_readonly("parts", cells_view(&Cells::parts),
                             "n: the part; 0 where nothing has a name, -1: none.")
      .def_property_readonly("regions", cells_view(&Cells::regions), "n: the region of the partition.")
      .def_property_readonly("levels", cells_view(&Cells::levels), "n: cuts that made the cell.")
      .def_property_readonly("volumes", cells_view(&Cells::volumes), "n: content of dimension D.")
      .def("__len__", [](const Result& self) { return self.cells().size(); })
      .def_property_readonly("volume_interval", &Result::volume,
                             "Interval: the volume of the solid is in it.")
      .def_property_readonly(
          "measures", [](const Result& self) { return self.measures(); }, "Measures of the whole.")
      .def_property_readonly("named_measures", &Result::named_measures,
                             "What the `measure` nodes found, by name.")
      .def_property_readonly("named_parts", &Result::parts, "The parts that have a name.")
      .def_property_readonly(
          "bounds",
          [](const Result& self) -> py::object {
            const auto [lower, upper] = self.bounds();
            if (lower.empty()) return py::none();
            return py::make_tuple(array_of(lower), array_of(upper));
          },
          "Two corners, of D numbers each; None if the solid is empty.")
      .def("surface", &Result::surface, Release(), "The surface, found when it is first asked for.")
      .def("contacts", &contacts_of,
           "Which IN cells touch in more than an edge: k x 2 cells, k x 2 faces of each, k areas.")
      .def("_locate", &located, arg("points"))
      .def(
          "_solver_mesh",
          [](const Result& self, const py::dict& given) {
            const SolverMeshOptions options = solver_mesh_options(given);
            const Released nothing_of_python;
            return self.solver_mesh(options);
          },
          arg("options"))
      .def(
          "_write",
          [](const Result& self, const std::filesystem::path& path, bool tets, std::optional<double> clean,
             const py::dict& look) {
            const WriteOptions options = write_options(tets, clean, look);
            const Released nothing_of_python;
            return self.write(path, options);
          },
          arg("path"), arg("tets"), arg("clean"), arg("look"))
      .def(
          "_picture",
          [](const Result& self, const std::string& format, const py::dict& look) {
            const View view = write_options(false, {}, look).view;
            std::string bytes;
            {
              const Released nothing_of_python;
              bytes = self.picture(format, view);
            }
            return py::bytes(bytes);
          },
          arg("format"), arg("look"))
      .def("_report", &Result::report)
      .def_property_readonly("warnings", &Result::warnings, "What there is to say about it.")
      .def_property_readonly("notes", &Result::notes, "What is as it should be, but may surprise.");
}

/// Of MPI, until the process ends: whoever holds a result of it may be gone later than Python.
std::optional<Ranks> launched_ranks;

}  // namespace

PYBIND11_MODULE(_bsp2, m) {
  m.doc() =
      "Solids of 1 to 6 dimensions: expressions, their evaluation to convex cells. Use it as `import bsp2`.";
  m.attr("__version__") = version();
  m.attr("OUT") = int{label::out};
  m.attr("IN") = int{label::in};
  m.attr("FUZZY") = int{label::fuzzy};
  static const py::exception<Error> error_type(m, "Error", PyExc_RuntimeError);
  error_type.attr("__doc__") =
      "What went wrong, in a sentence. is_users_mistake: of a model, an option or a file; else of the "
      "library.";
  // NOLINTNEXTLINE(performance-unnecessary-value-param): as pybind11 asks for it
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& error) {
      if (Released::raised) {
        Released::raised->restore();
        return Released::raised.reset();
      }
      const py::object made = py::reinterpret_borrow<py::object>(error_type)(py::str(error.what()));
      made.attr("is_users_mistake") = error.is_users_mistake();
      PyErr_SetObject(error_type.ptr(), made.ptr());
    } catch (
        const py::cast_error& error) {  // of an argument that was looked at more closely than by its type
      PyErr_SetString(PyExc_TypeError, error.what());
    }
  });
  add_nodes(m);
  add_measures(m);
  add_result(m);
  add_solver_mesh(m);
  m.def("_launched", [] {
    if (!launched_ranks) launched_ranks = Ranks::launched();
    return *launched_ranks;
  });
  m.def(
      "_evaluate",
      [](const Expression& expression, const py::dict& options, const py::object& progress,
         const py::object& stop, const Ranks& ranks) {
        return listened(options_of(options), progress, stop,
                        [&](const Options& all) { return evaluate(expression, all, ranks); });
      },
      arg("expression"), arg("options"), arg("progress"), arg("stop"), arg("ranks"));
  m.def(
      "_draw",
      [](const Expression& expression, const std::vector<std::filesystem::path>& files, const py::dict& words,
         const py::dict& options, const py::object& progress, const py::object& stop, const Ranks& ranks) {
        const DrawingOptions drawing = drawing_options(words);
        return listened<std::vector<std::string>>(
            options_of(options), progress, stop,
            [&](const Options& all) { return draw(expression, files, drawing, all, ranks); });
      },
      arg("expression"), arg("files"), arg("drawing"), arg("options"), arg("progress"), arg("stop"),
      arg("ranks"));
  m.def(
      "_resume",
      [](const std::filesystem::path& snapshot, const py::dict& options, const py::object& progress,
         const py::object& stop, const Ranks& ranks) {
        return listened(options_of(options), progress, stop,
                        [&](const Options& all) { return resume(snapshot, all, ranks); });
      },
      arg("snapshot"), arg("options"), arg("progress"), arg("stop"), arg("ranks"));
}

}  // namespace bsp2::python
