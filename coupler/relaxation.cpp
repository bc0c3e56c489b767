#include "coupler/relaxation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace ocublast::coupler {
namespace {

using Vector = Eigen::VectorXd;
using View = Eigen::Map<const Vector>;

View view(std::span<const double> values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

class Constant : public Relaxation {
 public:
  explicit Constant(double factor) : factor_(factor) {}
  void begin_window() override {}
  void advance(std::span<double> x, std::span<const double> residual) override {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += factor_ * residual[i];
  }

 private:
  double factor_;
};

class Aitken : public Relaxation {
 public:
  explicit Aitken(double factor) : first_(factor), factor_(factor) {}
  void begin_window() override {
    factor_ = first_;
    before_.resize(0);
  }
  void advance(std::span<double> x, std::span<const double> residual) override {
    const View r = view(residual);
    if (before_.size() == r.size()) {
      const double square = (r - before_).squaredNorm();
      if (square > 0.0) factor_ *= -before_.dot(r - before_) / square;
    }
    before_ = r;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += factor_ * residual[i];
  }

 private:
  double first_, factor_;
  Vector before_;
};

/// A column whose part outside the span of the newer ones is smaller than this share of it adds
/// nothing but rounding: differences of nearly converged iterates.
constexpr double dependent_share = 1e-7;

class InverseLeastSquares : public Relaxation {
 public:
  explicit InverseLeastSquares(double factor) : factor_(factor) {}
  void begin_window() override {
    residual_steps_.clear();
    output_steps_.clear();
    residual_before_.resize(0);
  }
  void advance(std::span<double> x, std::span<const double> residual) override;

 private:
  [[nodiscard]] Vector correction(const View& residual) const;

  double factor_;
  std::vector<Vector> residual_steps_, output_steps_;  ///< newest last
  Vector residual_before_, output_before_;
};

/// W c with c = argmin |V c + r|, V orthogonalised from the newest column on (modified
/// Gram-Schmidt, once repeated), columns that depend on newer ones left out.
Vector InverseLeastSquares::correction(const View& residual) const {
  std::vector<Vector> q;
  std::vector<std::size_t> kept;
  std::vector<Vector> rows;  // of R, by column
  for (std::size_t k = residual_steps_.size(); k-- > 0;) {
    Vector v = residual_steps_[k];
    const double length = v.norm();
    Vector projections = Vector::Zero(static_cast<Eigen::Index>(q.size()) + 1);
    for (int pass = 0; pass < 2; ++pass)
      for (std::size_t j = 0; j < q.size(); ++j) {
        const double share = q[j].dot(v);
        projections[static_cast<Eigen::Index>(j)] += share;
        v -= share * q[j];
      }
    const double rest = v.norm();
    if (!(rest > dependent_share * length)) continue;
    projections[static_cast<Eigen::Index>(q.size())] = rest;
    q.push_back(v / rest);
    rows.push_back(projections);
    kept.push_back(k);
  }
  const auto n = static_cast<Eigen::Index>(q.size());
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(n, n);
  Vector b(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    R.col(j).head(j + 1) = rows[static_cast<std::size_t>(j)];
    b[j] = -q[static_cast<std::size_t>(j)].dot(residual);
  }
  const Vector c = R.triangularView<Eigen::Upper>().solve(b);
  Vector out = Vector::Zero(residual.size());
  for (Eigen::Index j = 0; j < n; ++j)
    out += c[j] * output_steps_[kept[static_cast<std::size_t>(j)]];
  return out;
}

void InverseLeastSquares::advance(std::span<double> x, std::span<const double> residual) {
  const View r = view(residual);
  Eigen::Map<Vector> input(x.data(), static_cast<Eigen::Index>(x.size()));
  const Vector output = input + r;
  if (residual_before_.size() == r.size()) {
    residual_steps_.push_back(r - residual_before_);
    output_steps_.push_back(output - output_before_);
  }
  residual_before_ = r;
  output_before_ = output;
  if (residual_steps_.empty())
    input += factor_ * r;
  else
    input = output + correction(r);
}

}  // namespace

std::unique_ptr<Relaxation> make_relaxation(RelaxationKind kind, double factor) {
  switch (kind) {
    case RelaxationKind::constant:
      return std::make_unique<Constant>(factor);
    case RelaxationKind::aitken:
      return std::make_unique<Aitken>(factor);
    case RelaxationKind::iqn_ils:
      return std::make_unique<InverseLeastSquares>(factor);
  }
  return nullptr;
}

}  // namespace ocublast::coupler
