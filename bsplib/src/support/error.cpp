#include "bsp2/bsplib/error.hpp"

#include <utility>

namespace bsp2::bsplib {

namespace {

std::string compose(const std::string& where, const std::string& detail, int culprit,
                    std::uint64_t superstep) {
  return where + ": " + detail + " (rank " + std::to_string(culprit) + ", superstep " +
         std::to_string(superstep) + ")";
}

}  // namespace

Error::Error(Errc code, int culprit, std::uint64_t superstep, std::string where, std::string detail,
             bool agreed, bool own)
    : std::runtime_error(compose(where, detail, culprit, superstep)),
      code_(code),
      culprit_(culprit),
      superstep_(superstep),
      where_(std::move(where)),
      detail_(std::move(detail)),
      agreed_(agreed),
      own_(own) {}

}  // namespace bsp2::bsplib
