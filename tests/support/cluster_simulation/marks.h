#pragma once

#include <cstddef>
#include <vector>

#include "tests/support/cluster_simulation/index.h"

namespace terracast::test {

/// How many of a stage's shards have a property, between two of them (a Fenwick tree).
class Marks {
 public:
  explicit Marks(std::size_t size) : sums_(size + 1, 0) {}
  void add(int index, int change) {
    total_ += change;
    for (std::size_t i = at(index) + 1; i < sums_.size(); i += i & (~i + 1)) sums_[i] += change;
  }
  int total() const { return total_; }
  /// Around from `begin` up to `end`; all where they are equal.
  int around(int begin, int end) const {
    return begin < end ? before(end) - before(begin) : total_ - before(begin) + before(end);
  }

 private:
  int before(int index) const {
    int sum = 0;
    for (std::size_t i = at(index); i > 0; i -= i & (~i + 1)) sum += sums_[i];
    return sum;
  }
  std::vector<int> sums_;
  int total_ = 0;
};

}  // namespace terracast::test
