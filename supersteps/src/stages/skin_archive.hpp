#pragma once

#include <array>

#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/skin_share.hpp"

/// What ranks tell each other of a surface.
namespace boost::serialization {
template <class Archive>
void serialize(Archive& archive, bsp2::geometry::Skin& skin, unsigned) {
  archive& skin.vertices& skin.incident_offset& skin.incident& skin.faces& skin.edges;
}
template <class Archive>
void serialize(Archive& archive, bsp2::geometry::SurfacePiece& piece, unsigned) {
  archive& piece.faces& piece.triangles& piece.points& piece.shared;
}
template <class Archive>
void serialize(Archive& archive, bsp2::geometry::BrepPiece& piece, unsigned) {
  archive& piece.surface& piece.connected& piece.faces& piece.triangles& piece.loops& piece.uses& piece
      .edges& piece.uses_of_edges& piece.angles& piece.apexes;
}
template <>
struct is_bitwise_serializable<std::array<bsp2::geometry::HyperplaneId, 3>> : mpl::true_ {};
template <>
struct is_bitwise_serializable<std::array<double, 3>> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::Skin::Face> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::Skin::Edge> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::SkinShare::Claim> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::SkinShare::Decision> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::CertainBox> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::SurfacePiece::Face> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::SurfacePiece::SharedPoint> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::BrepPiece::Face> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::BrepPiece::Edge> : mpl::true_ {};
}  // namespace boost::serialization
