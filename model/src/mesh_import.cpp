#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "bsp2/geometry/error.hpp"
#include "imports.hpp"

namespace bsp2::model {

ImportedMesh import_mesh(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) throw Error("import: there is no file " + path.string());
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_PreTransformVertices | aiProcess_SortByPType);
  if (scene == nullptr) throw Error("import: " + path.string() + " cannot be read: " + importer.GetErrorString());
  ImportedMesh result;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(result.points.size());
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) result.points.push_back({mesh.mVertices[i].x, mesh.mVertices[i].y, mesh.mVertices[i].z});
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      for (unsigned k = face.mNumIndices; k-- > 0;) result.faces.corners.push_back(first + face.mIndices[k]);
      result.faces.end_face();
    }
  }
  return result;
}

}  // namespace bsp2::model
