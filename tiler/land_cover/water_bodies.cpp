#include "tiler/land_cover/water_bodies.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace terracast::tiler {
namespace {

/// Which runs belong together; the first run of a body stands for it.
class Unions {
 public:
  std::size_t add() {
    parent_.push_back(parent_.size());
    return parent_.size() - 1;
  }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

bool overlap(const SampleRun& a, const SampleRun& b) {
  return a.first_column < b.first_column + b.num_columns &&
         b.first_column < a.first_column + a.num_columns;
}

}  // namespace

std::vector<std::vector<SampleRun>> find_bodies(
    const Grid<std::uint8_t>& values, const std::function<bool(std::uint8_t)>& is_member) {
  std::vector<SampleRun> runs;
  Unions unions;
  std::size_t above = 0;  // first run of the row above, which ends at `here`
  std::size_t here = 0;
  for (int j = 0; j < values.height; ++j) {
    for (int i = 0; i < values.width;) {
      if (!is_member(values(i, j))) {
        ++i;
        continue;
      }
      SampleRun run{.row = j, .first_column = i, .num_columns = 0};
      while (i < values.width && is_member(values(i, j))) {
        ++run.num_columns;
        ++i;
      }
      const std::size_t index = unions.add();
      runs.push_back(run);
      while (above < here && runs[above].first_column + runs[above].num_columns <= run.first_column)
        ++above;
      for (std::size_t k = above; k < here && overlap(runs[k], run); ++k) unions.join(k, index);
    }
    above = here;
    here = runs.size();
  }
  std::vector<std::vector<SampleRun>> bodies;
  std::vector<std::size_t> body_of(runs.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const std::size_t root = unions.root(k);
    if (root == k) {
      body_of[k] = bodies.size();
      bodies.emplace_back();
    }
    bodies[body_of[root]].push_back(runs[k]);
  }
  return bodies;
}

}  // namespace terracast::tiler
