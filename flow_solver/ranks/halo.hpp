#pragma once

#include <memory>
#include <vector>

#include "coupler/base/rank_exchange.hpp"
#include "flow_solver/numerics/kernel.hpp"
#include "flow_solver/ranks/rank_part.hpp"

namespace ocublast::flow::inline OCU_PRECISION {

/// Messages and bytes that a rank sends.
struct Traffic {
  double messages = 0.0, bytes = 0.0;
  Traffic& operator+=(const Traffic& t) {
    messages += t.messages;
    bytes += t.bytes;
    return *this;
  }
};

/// What a halo carries: layers of the fields next to the borders across the axes in the mask.
struct HaloSpec {
  int channel = 0;    ///< of RankExchange
  unsigned axes = 7;  ///< bit per axis
  std::vector<int> fields;
  int depth = 1;  ///< layers, at most n_ghost
  /// Rows and planes reach into the ghosts of the axes before, so that edges and corners are filled
  /// when the axes follow one after another.
  bool corners = false;
};

/// Copies the nodes next to a rank's borders into its neighbours' ghosts. Does nothing along axes
/// that are not divided.
class Halo {
 public:
  Halo(const RankPart& part, HaloSpec spec);
  /// Packs and sends; the ghosts hold the neighbours' nodes after `finish`.
  void start(const Block& block);
  /// Until the messages are there; `finish` does it where it has not been done, and unpacks.
  void wait();
  void finish(const Block& block);
  /// What this rank sends each time.
  [[nodiscard]] Traffic traffic() const;

 private:
  struct Face {
    int axis;
    bool low;
    int peer;
    std::vector<Real> out, in;
  };
  template <class Copy>
  void for_rows(const Face& face, const Block& block, int layer0, const Copy& copy) const;
  const RankPart* part_;
  HaloSpec spec_;
  std::vector<std::unique_ptr<Face>> faces_;
  std::unique_ptr<RankExchange> exchange_;
};

}  // namespace ocublast::flow
