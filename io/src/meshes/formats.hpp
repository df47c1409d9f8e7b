#pragma once

#include "bsp2/io/outputs/solver_mesh.hpp"

// One file each: see write_solver_mesh.
namespace bsp2::io {

void write_openfoam(const std::filesystem::path& marker, const SolverMesh& mesh);
void write_solver_vtu(const std::filesystem::path& path, const SolverMesh& mesh);
void write_gmsh(const std::filesystem::path& path, const SolverMesh& mesh, int version);
void write_abaqus(const std::filesystem::path& path, const SolverMesh& mesh);
void write_xdmf(const std::filesystem::path& path, const SolverMesh& mesh);

}  // namespace bsp2::io
