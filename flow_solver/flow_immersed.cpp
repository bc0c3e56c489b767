// The real immersed boundary behind the interface of the step.

#include <utility>

#include "flow_solver/step.hpp"

namespace ocublast::flow::inline OCU_PRECISION {
namespace {

class ImmersedBodies final : public BodiesInFlow {
 public:
  explicit ImmersedBodies(ImmersedBoundary& boundary) : boundary_(&boundary) {}
  void move_to(double t) override { boundary_->move_to(t); }
  void compute_ghosts(FieldsView<Real> W) override { boundary_->compute_ghosts(W); }
  TopologyReport update_topology(FieldsView<Real> W) override {
    return boundary_->update_topology(W);
  }
  [[nodiscard]] const CutLines& lines(int axis) const override { return boundary_->lines(axis); }
  [[nodiscard]] std::span<const std::uint8_t> tags() const override { return boundary_->tags(); }

 private:
  ImmersedBoundary* boundary_;
};

}  // namespace

void Flow::immerse(ImmersedBoundary* bodies) {
  immerse(bodies == nullptr
              ? std::unique_ptr<BodiesInFlow>()
              : std::unique_ptr<BodiesInFlow>(std::make_unique<ImmersedBodies>(*bodies)));
}

}  // namespace ocublast::flow
