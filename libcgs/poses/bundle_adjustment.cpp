// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/poses/bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <utility>

#include <Eigen/Dense>
#include <ceres/ceres.h>

namespace cgs {

namespace {

// Doubles of a photograph: quaternion x y z w, translation; of a lens: log(focal), k1, principal
// point.
constexpr size_t kRotation = 0;
constexpr size_t kTranslation = 4;
constexpr size_t kPerPhoto = 7;
constexpr size_t kPerLens = 4;

struct Reprojection {
  Eigen::Vector2d at;
  double sigma;
  int turns;

  template <typename T>
  bool operator()(
      const T* rotation, const T* translation, const T* lens, const T* point, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t(translation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> x(point);
    const Eigen::Matrix<T, 3, 1> p = q * x + t;
    if (!(p.z() > T(0))) return false;
    const Eigen::Matrix<T, 2, 1> direction = p.template head<2>() / p.z();
    using std::exp;
    const auto centre = turned(Eigen::Matrix<T, 2, 1>(lens[2], lens[3]), turns);
    const Eigen::Matrix<T, 2, 1> seen = through_lens<T>(exp(lens[0]), lens[1], centre, direction);
    out[0] = (seen.x() - T(at.x())) / T(sigma);
    out[1] = (seen.y() - T(at.y())) / T(sigma);
    return true;
  }
};

struct FocalPrior {
  LensPrior prior;

  template <typename T>
  bool operator()(const T* lens, T* out) const {
    out[0] = (lens[0] - T(std::log(prior.focal))) * T(kOptimism / prior.sigma);
    return true;
  }
};

/// What lenses are like: little distortion, the principal point near the centre. Where photographs
/// tell otherwise they win; where they tell nothing, the lens stays plain.
struct ShapePrior {
  double side;

  template <typename T>
  bool operator()(const T* lens, T* out) const {
    constexpr double kDistortion = 0.09;
    constexpr double kOffCentre = 0.015;  // [larger sides]
    out[0] = lens[1] * T(kOptimism / kDistortion);
    out[1] = lens[2] * T(kOptimism / (kOffCentre * side));
    out[2] = lens[3] * T(kOptimism / (kOffCentre * side));
    return true;
  }
};

struct PoseRestraint {
  PosePrior prior;

  template <typename T>
  bool operator()(const T* rotation, const T* translation, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Eigen::Matrix<T, 3, 1>> t(translation);
    const Eigen::Quaternion<T> turn = q * prior.pose.rotation.conjugate().cast<T>();
    const Eigen::Matrix<T, 3, 1> center = -(q.conjugate() * t);
    const Eigen::Matrix<T, 3, 1> moved = center - prior.pose.center().cast<T>();
    const T sign = turn.w() < T(0) ? T(-1) : T(1);
    for (int i = 0; i < 3; ++i) {
      out[i] = T(2) * sign * turn.vec()[i] / T(prior.rotation_sigma);
      out[3 + i] = moved[i] / T(prior.center_sigma);
    }
    return true;
  }
};

/// The unknowns, each kind in one piece of memory: Ceres sorts by address, and the order must be
/// the same in every run.
struct Unknowns {
  std::vector<double> cameras;
  std::vector<double> points;
  size_t photos;

  explicit Unknowns(const Reconstruction& scene) : photos(scene.poses.size()) {
    cameras.resize(kPerPhoto * photos + kPerLens * scene.lenses.size());
    for (size_t i = 0; i < photos; ++i) {
      if (!scene.poses[i]) continue;
      Eigen::Map<Eigen::Vector4d>(rotation(i)) = scene.poses[i]->rotation.coeffs();
      Eigen::Map<Eigen::Vector3d>(translation(i)) = scene.poses[i]->translation;
    }
    for (size_t i = 0; i < scene.lenses.size(); ++i) {
      lens(i)[0] = std::log(scene.lenses[i].focal);
      lens(i)[1] = scene.lenses[i].k1;
      Eigen::Map<Eigen::Vector2d>(lens(i) + 2) = scene.lenses[i].centre;
    }
    points.resize(3 * scene.tracks.size());
    for (size_t i = 0; i < scene.tracks.size(); ++i) {
      Eigen::Map<Eigen::Vector3d>(point(i)) = scene.tracks[i].position;
    }
  }
  double* rotation(size_t i) { return cameras.data() + kPerPhoto * i + kRotation; }
  double* translation(size_t i) { return cameras.data() + kPerPhoto * i + kTranslation; }
  double* lens(size_t i) { return cameras.data() + kPerPhoto * photos + kPerLens * i; }
  double* point(size_t i) { return points.data() + 3 * i; }

  // A length that was held keeps its last bit.
  double focal(size_t i, const Lens& before) {
    return lens(i)[0] == std::log(before.focal) ? before.focal : std::exp(lens(i)[0]);
  }

  void write_to(Reconstruction& scene) {
    for (size_t i = 0; i < photos; ++i) {
      if (!scene.poses[i]) continue;
      scene.poses[i]->rotation.coeffs() = Eigen::Map<Eigen::Vector4d>(rotation(i));
      scene.poses[i]->rotation.normalize();
      scene.poses[i]->translation = Eigen::Map<Eigen::Vector3d>(translation(i));
    }
    for (size_t i = 0; i < scene.lenses.size(); ++i) {
      scene.lenses[i] = {
          focal(i, scene.lenses[i]), lens(i)[1], Eigen::Map<Eigen::Vector2d>(lens(i) + 2)};
    }
    for (size_t i = 0; i < scene.tracks.size(); ++i) {
      if (scene.tracks[i].is_known) {
        scene.tracks[i].position = Eigen::Map<Eigen::Vector3d>(point(i));
      }
    }
  }
};

void add_observations(const Reconstruction& scene,
                      Unknowns& unknowns,
                      ceres::LossFunction* loss,
                      ceres::Problem& problem) {
  for (size_t k = 0; k < scene.tracks.size(); ++k) {
    if (!scene.tracks[k].is_known) continue;
    for (const Observation& s : scene.tracks[k].seen) {
      const auto photo = static_cast<size_t>(s.photo);
      if (!s.is_used || !scene.poses[photo]) continue;
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Reprojection, 2, 4, 3, kPerLens, 3>(
                                   new Reprojection{s.at, s.sigma, scene.turns_of(s.photo)}),
                               loss,
                               unknowns.rotation(photo),
                               unknowns.translation(photo),
                               unknowns.lens(static_cast<size_t>(scene.lens_of[photo])),
                               unknowns.point(k));
    }
  }
}

void restrain_poses(const BundleOptions& options, Unknowns& unknowns, ceres::Problem& problem) {
  for (size_t i = 0; i < options.pose_priors.size(); ++i) {
    if (!problem.HasParameterBlock(unknowns.rotation(i))) continue;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PoseRestraint, 6, 4, 3>(
                                 new PoseRestraint{options.pose_priors[i]}),
                             nullptr,
                             unknowns.rotation(i),
                             unknowns.translation(i));
  }
}

// Rotations stay rotations; seven freedoms that no photograph can tell are held.
void hold_gauge(const BundleOptions& options, Unknowns& unknowns, ceres::Problem& problem) {
  for (size_t i = 0; i < unknowns.photos; ++i) {
    if (!problem.HasParameterBlock(unknowns.rotation(i))) continue;
    problem.SetManifold(unknowns.rotation(i), new ceres::EigenQuaternionManifold);
    if (options.hold_poses || static_cast<int>(i) == options.first) {
      problem.SetParameterBlockConstant(unknowns.rotation(i));
      problem.SetParameterBlockConstant(unknowns.translation(i));
    } else if (static_cast<int>(i) == options.second) {
      problem.SetManifold(unknowns.translation(i), new ceres::SphereManifold<3>);
    }
  }
}

void hold_points(const Reconstruction& scene, Unknowns& unknowns, ceres::Problem& problem) {
  for (size_t k = 0; k < scene.tracks.size(); ++k) {
    if (problem.HasParameterBlock(unknowns.point(k))) {
      problem.SetParameterBlockConstant(unknowns.point(k));
    }
  }
}

// \return per lens, whether its focal length is held
std::vector<bool> hold_lenses(const std::vector<LensPrior>& priors,
                              const BundleOptions& options,
                              Unknowns& unknowns,
                              ceres::Problem& problem) {
  std::vector<bool> held(priors.size(), true);
  for (size_t i = 0; i < priors.size(); ++i) {
    double* const lens = unknowns.lens(i);
    if (!problem.HasParameterBlock(lens)) continue;
    const bool is_exact = priors[i].focal > 0 && priors[i].sigma == 0;
    const bool solve_focal = options.solve_focal && !is_exact;
    held[i] = !solve_focal;
    if (!solve_focal && !options.solve_shape) {
      problem.SetParameterBlockConstant(lens);
    } else if (!solve_focal) {
      problem.SetManifold(lens, new ceres::SubsetManifold(kPerLens, {0}));
    } else if (!options.solve_shape) {
      problem.SetManifold(lens, new ceres::SubsetManifold(kPerLens, {1, 2, 3}));
    }
    if (solve_focal && priors[i].focal > 0) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<FocalPrior, 1, kPerLens>(new FocalPrior{priors[i]}),
          nullptr,
          lens);
    }
    if (options.solve_shape) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<ShapePrior, 3, kPerLens>(new ShapePrior{priors[i].side}),
          nullptr,
          lens);
    }
  }
  return held;
}

ceres::Solver::Options solver_options(const BundleOptions& options,
                                      const Reconstruction& scene,
                                      Unknowns& unknowns,
                                      const ceres::Problem& problem) {
  ceres::Solver::Options out;
  out.linear_solver_type = ceres::DENSE_SCHUR;
  out.num_threads = 1;  // sums in one order: same bits every time
  out.max_num_iterations = options.most_iterations;
  out.function_tolerance = 1e-9;
  out.logging_type = ceres::SILENT;
  out.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (size_t k = 0; k < scene.tracks.size(); ++k) {
    if (problem.HasParameterBlock(unknowns.point(k))) {
      out.linear_solver_ordering->AddElementToGroup(unknowns.point(k), 0);
    }
  }
  for (size_t i = 0; i < scene.poses.size(); ++i) {
    if (!problem.HasParameterBlock(unknowns.rotation(i))) continue;
    out.linear_solver_ordering->AddElementToGroup(unknowns.rotation(i), 1);
    out.linear_solver_ordering->AddElementToGroup(unknowns.translation(i), 1);
  }
  for (size_t i = 0; i < scene.lenses.size(); ++i) {
    if (problem.HasParameterBlock(unknowns.lens(i))) {
      out.linear_solver_ordering->AddElementToGroup(unknowns.lens(i), 1);
    }
  }
  return out;
}

// Ends the solver where the progress function throws: no exception may pass through it.
class IterationReport : public ceres::IterationCallback {
 public:
  explicit IterationReport(const BundleOptions& options) : options_(options) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    try {
      report(options_.progress, double(summary.iteration) / options_.most_iterations);
    } catch (...) {
      thrown_ = std::current_exception();
      return ceres::SOLVER_ABORT;
    }
    return ceres::SOLVER_CONTINUE;
  }
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  const BundleOptions& options_;
  std::exception_ptr thrown_;
};

// The free parameter blocks of cameras and lenses; the column at which each begins, and their end.
struct CameraColumns {
  std::vector<double*> blocks;
  std::vector<int> column_of_lens;  // of log(focal); -1 = held
  int count = 0;
};

CameraColumns camera_columns(Unknowns& unknowns,
                             const std::vector<bool>& held_focal,
                             const ceres::Problem& problem) {
  CameraColumns out;
  const auto add = [&](double* block) {
    if (!problem.HasParameterBlock(block) || problem.IsParameterBlockConstant(block)) return false;
    out.blocks.push_back(block);
    out.count += problem.ParameterBlockTangentSize(block);
    return true;
  };
  for (size_t i = 0; i < unknowns.photos; ++i) {
    add(unknowns.rotation(i));
    add(unknowns.translation(i));
  }
  for (size_t i = 0; i < held_focal.size(); ++i) {
    const int column = out.count;
    const bool is_free = add(unknowns.lens(i)) && !held_focal[i];
    out.column_of_lens.push_back(is_free ? column : -1);
  }
  return out;
}

/// A row of a Jacobian: what it says of cameras, and of a point if there is one.
struct JacobianRow {
  std::vector<std::pair<int, double>> cameras;  ///< Columns and values.
  Eigen::RowVector3d point = Eigen::RowVector3d::Zero();
};

/// The rows of every point, and last those of none.
std::vector<std::vector<JacobianRow>> rows_by_point(const ceres::CRSMatrix& jacobian, int cameras) {
  const size_t points = static_cast<size_t>(jacobian.num_cols - cameras) / 3;
  std::vector<std::vector<JacobianRow>> out(points + 1);
  for (int r = 0; r < jacobian.num_rows; ++r) {
    JacobianRow row;
    size_t point = points;
    for (int k = jacobian.rows[r]; k < jacobian.rows[r + 1]; ++k) {
      const int column = jacobian.cols[k];
      if (column < cameras) {
        row.cameras.emplace_back(column, jacobian.values[k]);
      } else {
        point = static_cast<size_t>(column - cameras) / 3;
        row.point[(column - cameras) % 3] = jacobian.values[k];
      }
    }
    out[point].push_back(std::move(row));
  }
  return out;
}

std::vector<int> columns_of(const std::vector<JacobianRow>& rows) {
  std::vector<int> out;
  for (const JacobianRow& row : rows) {
    for (const auto& [column, value] : row.cameras) out.push_back(column);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

// What a point tells of the cameras that see it, once it is eliminated: of their columns alone, as
// hundreds of cameras have thousands.
void add_point(const std::vector<JacobianRow>& rows, bool is_point, Eigen::MatrixXd& H) {
  const std::vector<int> columns = columns_of(rows);
  const auto count = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(count, count);
  Eigen::Matrix<double, Eigen::Dynamic, 3> with_point = decltype(with_point)::Zero(count, 3);
  Eigen::Matrix3d of_point = Eigen::Matrix3d::Zero();
  Eigen::VectorXd c(count);
  for (const JacobianRow& row : rows) {
    c.setZero();
    for (const auto& [column, value] : row.cameras) {
      c[std::lower_bound(columns.begin(), columns.end(), column) - columns.begin()] = value;
    }
    own += c * c.transpose();
    with_point += c * row.point;
    of_point += row.point.transpose() * row.point;
  }
  if (is_point) own -= with_point * of_point.ldlt().solve(with_point.transpose());
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b < count; ++b) {
      H(columns[static_cast<size_t>(a)], columns[static_cast<size_t>(b)]) += own(a, b);
    }
  }
}

// Normal equations of the cameras with the points eliminated (Schur complement).
Eigen::MatrixXd reduced_normal_equations(const ceres::CRSMatrix& jacobian, int cameras) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(cameras, cameras);
  const std::vector<std::vector<JacobianRow>> rows = rows_by_point(jacobian, cameras);
  for (const std::vector<JacobianRow>& of_point : rows) {
    if (&of_point != &rows.back()) add_point(of_point, true, H);
  }
  for (const JacobianRow& prior : rows.back()) add_point({prior}, false, H);
  return H;
}

std::vector<double> focal_sigmas(const Reconstruction& scene,
                                 const std::vector<bool>& held_focal,
                                 Unknowns& unknowns,
                                 ceres::Problem& problem) {
  const CameraColumns cameras = camera_columns(unknowns, held_focal, problem);
  ceres::Problem::EvaluateOptions options;
  options.num_threads = 1;
  options.parameter_blocks = cameras.blocks;
  for (size_t k = 0; k < scene.tracks.size(); ++k) {
    if (problem.HasParameterBlock(unknowns.point(k))) {
      options.parameter_blocks.push_back(unknowns.point(k));
    }
  }
  ceres::CRSMatrix jacobian;
  std::vector<double> sigmas(scene.lenses.size(), 0.0);
  const bool is_evaluated = problem.Evaluate(options, nullptr, nullptr, nullptr, &jacobian);
  const Eigen::LDLT<Eigen::MatrixXd> H(is_evaluated
                                           ? reduced_normal_equations(jacobian, cameras.count)
                                           : Eigen::MatrixXd::Zero(cameras.count, cameras.count));
  for (size_t i = 0; i < scene.lenses.size(); ++i) {
    const int column = cameras.column_of_lens[i];
    if (column < 0) continue;
    const double variance =
        H.isPositive() ? H.solve(Eigen::VectorXd::Unit(cameras.count, column))[column] : -1;
    sigmas[i] = variance > 0 ? std::sqrt(variance) : std::numeric_limits<double>::infinity();
  }
  return sigmas;
}

}  // namespace

std::vector<double> adjust_bundle(Reconstruction& scene,
                                  const std::vector<LensPrior>& priors,
                                  const BundleOptions& options,
                                  bool with_sigma) {
  Unknowns unknowns(scene);
  ceres::CauchyLoss loss(options.loss_scale / kFeatureSigma);
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  add_observations(scene, unknowns, &loss, problem);
  if (problem.NumResidualBlocks() == 0) return std::vector<double>(scene.lenses.size(), 0.0);
  restrain_poses(options, unknowns, problem);
  hold_gauge(options, unknowns, problem);
  if (options.hold_points) hold_points(scene, unknowns, problem);
  const std::vector<bool> held_focal = hold_lenses(priors, options, unknowns, problem);
  ceres::Solver::Summary summary;
  ceres::Solver::Options solver = solver_options(options, scene, unknowns, problem);
  IterationReport iterations(options);
  solver.callbacks.push_back(&iterations);
  ceres::Solve(solver, &problem, &summary);
  iterations.rethrow();
  if (summary.IsSolutionUsable()) unknowns.write_to(scene);
  if (!with_sigma) return std::vector<double>(scene.lenses.size(), 0.0);
  return focal_sigmas(scene, held_focal, unknowns, problem);
}

}  // namespace cgs
