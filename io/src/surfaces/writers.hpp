#pragma once

#include <string>
#include <vector>

#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "outputs/single_precision.hpp"
#include "surfaces/labels.hpp"

// The bytes of files, one function a format.

namespace bsp2::io {

/// @param surface is still there when the pieces are asked for.
Pieces to_stl(const SingleSurface& surface);
/// Likewise.
Pieces to_ply(const geometry::TriangleSurface& surface, const PartLabels& labels);
/// @param material_file the name of the file with the colours; empty: none are named.
std::string to_obj(const geometry::TriangleSurface& surface, const PartLabels& labels,
                   const std::string& material_file);
std::string to_mtl(const geometry::TriangleSurface& surface, const PartLabels& labels);

/// @param notes what is told of the file is added, as parts of a sentence that begins with its name.
std::string to_off(const geometry::TriangleSurface& surface, const PartLabels& labels,
                   std::vector<std::string>& notes);
/// Likewise. @param surface closes parts that touch; its corners are rounded to single precision.
std::string to_amf(const geometry::TriangleSurface& surface, const PartLabels& labels,
                   std::vector<std::string>& notes);
/// Likewise.
std::string to_3mf(const geometry::TriangleSurface& surface, const PartLabels& labels,
                   std::vector<std::string>& notes);

enum class GltfForm { binary, text };
std::string to_gltf(const SingleSurface& surface, const PartLabels& labels, GltfForm form);
std::string to_vrml(const SingleSurface& surface, const PartLabels& labels);
std::string to_x3d(const SingleSurface& surface, const PartLabels& labels);

}  // namespace bsp2::io
