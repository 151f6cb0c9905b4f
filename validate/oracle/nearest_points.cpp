#include "validate/oracle/nearest_points.h"

#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/error.h"
#include "core/parallel.h"

namespace terracast::validate {

namespace {

using PlainKernel = CGAL::Simple_cartesian<double>;
using PointSearch = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<PlainKernel>>;

}  // namespace

std::vector<double> nearest_distances_m(std::span<const Eigen::Vector3d> points,
                                        std::span<const Eigen::Vector3d> queries) {
  TERRACAST_CHECK(!points.empty());
  // A leaf of equal points cannot be split: many of them would make each query a walk through all.
  std::vector<Eigen::Vector3d> unique(points.begin(), points.end());
  std::sort(unique.begin(), unique.end(), [](const auto& a, const auto& b) {
    return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z());
  });
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  PointSearch::Tree tree;
  tree.reserve(unique.size());
  for (const Eigen::Vector3d& point : unique)
    tree.insert(PlainKernel::Point_3(point.x(), point.y(), point.z()));
  tree.build();
  std::vector<double> distances(queries.size());
  constexpr std::int64_t kBlock = 4096;
  const auto num_queries = static_cast<std::int64_t>(queries.size());
  core::parallel_for((num_queries + kBlock - 1) / kBlock, [&](std::int64_t block) {
    const std::int64_t end = std::min(num_queries, (block + 1) * kBlock);
    for (std::int64_t i = block * kBlock; i < end; ++i) {
      const Eigen::Vector3d& query = queries[static_cast<std::size_t>(i)];
      const PointSearch search(tree, PlainKernel::Point_3(query.x(), query.y(), query.z()), 1);
      distances[static_cast<std::size_t>(i)] = std::sqrt(search.begin()->second);
    }
  });
  return distances;
}

}  // namespace terracast::validate
