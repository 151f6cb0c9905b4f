#include "validate/colmap/similarity.h"

#include <gtest/gtest.h>

namespace terracast::validate {
namespace {

using Eigen::Vector3d;

const std::vector<Vector3d> kPoints{{0, 0, 0}, {10, 1, 2}, {3, 8, -4}, {-5, 2, 7}, {1, -6, 3}};

TEST(Similarity, FindsTheOneThatMovedThePoints) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(2.1, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Vector3d shift(100.0, -20.0, 5.0);
  std::vector<Vector3d> targets;
  for (const Vector3d& point : kPoints) targets.push_back(0.37 * (turn * point) + shift);
  const Similarity found = best_similarity(kPoints, targets);
  EXPECT_NEAR(found.scale, 0.37, 1e-12);
  EXPECT_LE((found.rotation - turn).norm(), 1e-12);
  EXPECT_LE((found.translation - shift).norm(), 1e-10);
  for (std::size_t i = 0; i < kPoints.size(); ++i)
    EXPECT_LE((found * kPoints[i] - targets[i]).norm(), 1e-10);
}

TEST(Similarity, NeverMirrors) {
  std::vector<Vector3d> mirrored;
  for (const Vector3d& point : kPoints) mirrored.emplace_back(point.x(), point.y(), -point.z());
  EXPECT_NEAR(best_similarity(kPoints, mirrored).rotation.determinant(), 1.0, 1e-12);
}

TEST(Similarity, IsTheBestOfAllNearIt) {
  std::vector<Vector3d> targets = kPoints;
  targets[0] += Vector3d(0.5, 0.0, -0.2);
  targets[3] += Vector3d(-0.1, 0.4, 0.3);
  const Similarity best = best_similarity(kPoints, targets);
  const auto sum = [&](const Similarity& similarity) {
    double squares = 0.0;
    for (std::size_t i = 0; i < kPoints.size(); ++i)
      squares += (similarity * kPoints[i] - targets[i]).squaredNorm();
    return squares;
  };
  const double least = sum(best);
  for (const double step : {-1e-3, 1e-3}) {
    Similarity other = best;
    other.scale += step;
    EXPECT_GT(sum(other), least);
    for (int axis = 0; axis < 3; ++axis) {
      other = best;
      other.translation[axis] += step;
      EXPECT_GT(sum(other), least);
      other = best;
      other.rotation =
          Eigen::AngleAxisd(step, Vector3d::Unit(axis)).toRotationMatrix() * other.rotation;
      EXPECT_GT(sum(other), least);
    }
  }
}

TEST(Similarity, RootMeanSquareIsThatOfAHandfulOfNumbers) {
  EXPECT_DOUBLE_EQ(root_mean_square({3.0, -4.0, 0.0, 5.0}), std::sqrt(12.5));
  EXPECT_EQ(root_mean_square({}), 0.0);
}

}  // namespace
}  // namespace terracast::validate
