#pragma once

#include <bit>
#include <boost/archive/archive_exception.hpp>
#include <boost/archive/binary_iarchive.hpp>
#include <boost/archive/binary_iarchive_impl.hpp>
#include <boost/archive/binary_oarchive.hpp>
#include <boost/archive/impl/basic_binary_iarchive.ipp>
#include <boost/archive/impl/basic_binary_iprimitive.ipp>
#include <boost/iostreams/device/array.hpp>
#include <boost/iostreams/device/back_inserter.hpp>
#include <boost/iostreams/stream_buffer.hpp>
#include <boost/serialization/array.hpp>
#include <boost/serialization/array_optimization.hpp>
#include <boost/serialization/collection_size_type.hpp>
#include <boost/serialization/is_bitwise_serializable.hpp>
#include <boost/serialization/level.hpp>
#include <boost/serialization/split_free.hpp>
#include <boost/serialization/tracking.hpp>
#include <boost/serialization/vector.hpp>
#include <span>
#include <streambuf>
#include <string>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/regions/partition.hpp"

/// Boost.Serialization of what travels between ranks and is stored in snapshots: flat arrays, no class
/// headers, no tracking. Works with Boost's binary archives and with those of Boost.MPI.
///
/// Totals must be loaded into an object that was made for the same network. Of a region everything is stored
/// but its cell: `make_cells` or `add_regions` give it back, or take the cell that another copy of the
/// partition holds.
namespace boost::serialization {

template <class Archive, int D>
void save(Archive& archive, const bsp2::geometry::MomentSum<D>& sum, unsigned) {
  const auto state = sum.state();
  archive << make_array(state.exponent.data(), state.exponent.size())
          << make_array(state.words.data(), state.words.size());
}
template <class Archive, int D>
void load(Archive& archive, bsp2::geometry::MomentSum<D>& sum, unsigned) {
  auto state = sum.state();
  archive >> make_array(state.exponent.data(), state.exponent.size()) >>
      make_array(state.words.data(), state.words.size());
  sum.set_state(state);
}
template <class Archive, int D>
void serialize(Archive& archive, bsp2::geometry::MomentSum<D>& sum, unsigned version) {
  split_free(archive, sum, version);
}

template <class Archive>
void serialize(Archive& archive, bsp2::dataflow::Digest& digest, unsigned) {
  archive& make_array(digest.words.data(), digest.words.size());
}

template <class Archive>
void serialize(Archive& archive, bsp2::geometry::KernelCounts& counts, unsigned) {
  archive& counts.splits& counts.predicates& counts.exact_predicates& counts.vertices& counts.exact_vertices;
}

template <class Archive, int D>
void serialize(Archive& archive, bsp2::dataflow::Totals<D>& totals, unsigned) {
  archive& totals.in& totals.fuzzy& totals.fuzzy_below& totals.in_cells& totals.fuzzy_cells& totals.out_cells;
  archive& make_array(totals.lower.data(), totals.lower.size()) &
      make_array(totals.upper.data(), totals.upper.size());
  archive& totals.level& totals.digest& totals.counts& totals.parts;
}

template <class Archive>
void serialize(Archive& archive, bsp2::geometry::CellBatch& batch, unsigned) {
  archive& batch.dimension& batch.points& batch.point_offset& batch.facet_offset& batch
      .facet_vertex_offset& batch.facet_vertices;
  archive& batch.facet_hyperplane& batch.label& batch.primitive& batch.part& batch.region& batch.level& batch
      .volume;
}

template <class Archive>
void serialize(Archive& archive, bsp2::dataflow::Frontier& frontier, unsigned) {
  archive& frontier.nodes& frontier.programs;
}

template <class Archive, int D>
void serialize(Archive& archive, bsp2::dataflow::Region<D>& region, unsigned) {
  archive& region.number& region.level& region.program& region.frontier;
}

// Plain values whose bytes are their contents: vectors of them are stored as one array.
template <>
struct is_bitwise_serializable<bsp2::geometry::Label> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::dataflow::Frontier::Node> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::dataflow::PartitionNode> : mpl::true_ {};

// No header for each object, and no search for pointers to it.
template <int D>
struct implementation_level<bsp2::geometry::MomentSum<D>> : mpl::int_<object_serializable> {};
template <int D>
struct tracking_level<bsp2::geometry::MomentSum<D>> : mpl::int_<track_never> {};
template <int D>
struct implementation_level<bsp2::dataflow::Totals<D>> : mpl::int_<object_serializable> {};
template <int D>
struct tracking_level<bsp2::dataflow::Totals<D>> : mpl::int_<track_never> {};
template <int D>
struct implementation_level<bsp2::dataflow::Region<D>> : mpl::int_<object_serializable> {};
template <int D>
struct tracking_level<bsp2::dataflow::Region<D>> : mpl::int_<track_never> {};

}  // namespace boost::serialization

BOOST_CLASS_IMPLEMENTATION(bsp2::dataflow::Digest, boost::serialization::object_serializable)
BOOST_CLASS_TRACKING(bsp2::dataflow::Digest, boost::serialization::track_never)
BOOST_CLASS_IMPLEMENTATION(bsp2::geometry::KernelCounts, boost::serialization::object_serializable)
BOOST_CLASS_TRACKING(bsp2::geometry::KernelCounts, boost::serialization::track_never)
BOOST_CLASS_IMPLEMENTATION(bsp2::geometry::CellBatch, boost::serialization::object_serializable)
BOOST_CLASS_TRACKING(bsp2::geometry::CellBatch, boost::serialization::track_never)
BOOST_CLASS_IMPLEMENTATION(bsp2::dataflow::Frontier, boost::serialization::object_serializable)
BOOST_CLASS_TRACKING(bsp2::dataflow::Frontier, boost::serialization::track_never)

namespace bsp2::dataflow {

/// Boost's binary archive, but no length in it may be larger than what is left of the bytes: a damaged one
/// would fill the memory.
class InputArchive : public boost::archive::binary_iarchive_impl<InputArchive, char, std::char_traits<char>> {
  using Base = boost::archive::binary_iarchive_impl<InputArchive, char, std::char_traits<char>>;

 public:
  explicit InputArchive(std::streambuf& bytes) : Base(bytes, boost::archive::no_header) {
    init(boost::archive::no_header);
  }

  // The names are those that Boost looks for.
  template <class T>
  void load_override(T& value) {  // NOLINT(misc-unused-parameters): of empty types only
    Base::load_override(value);
  }
  void load_override(boost::serialization::collection_size_type& length) {
    Base::load_override(length);
    check(length);
  }
  void load_override(std::string& text) {
    std::size_t length = 0;
    this->load(length);
    check(length);
    text.resize(length);
    if (length > 0) this->load_binary(text.data(), length);
  }

 private:
  void check(std::size_t length) {
    const auto left = m_sb.in_avail();
    if (left < 0 || length > static_cast<std::size_t>(left))
      throw boost::archive::archive_exception(boost::archive::archive_exception::input_stream_error);
  }
};

/// An object as bytes; for the same version of the program on the same kind of machine.
template <typename T>
std::string to_bytes(const T& object) {
  std::string bytes;
  {
    boost::iostreams::stream_buffer<boost::iostreams::back_insert_device<std::string>> buffer(bytes);
    boost::archive::binary_oarchive archive(buffer, boost::archive::no_header);
    archive << object;
  }
  return bytes;
}

/// The object back. @throws boost::archive::archive_exception if the bytes are not those of a T.
template <typename T>
void from_bytes(std::span<const char> bytes, T& object) {
  boost::iostreams::stream_buffer<boost::iostreams::array_source> buffer(bytes.data(), bytes.size());
  InputArchive archive(buffer);
  archive >> object;
}

}  // namespace bsp2::dataflow

BOOST_SERIALIZATION_USE_ARRAY_OPTIMIZATION(bsp2::dataflow::InputArchive)
