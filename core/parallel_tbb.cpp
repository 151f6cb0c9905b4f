#ifndef TERRACAST_STD_THREADS

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include "core/parallel_backend.h"

namespace terracast::core::backend {

void* new_limit(int num_threads) {
  return new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                 static_cast<std::size_t>(num_threads));
}

void delete_limit(void* limit) { delete static_cast<tbb::global_control*>(limit); }

int num_threads_allowed() {
  return static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void for_each(std::int64_t count, const std::function<void(std::int64_t)>& body) {
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::int64_t>(0, count),
        [&](const tbb::blocked_range<std::int64_t>& range) {
          for (std::int64_t i = range.begin(); i < range.end(); ++i) body(i);
        },
        tbb::simple_partitioner());
  });
}

void in_order(std::int64_t count, int window, const std::function<bool()>& is_wanted,
              const std::function<void(std::int64_t)>& make,
              const std::function<void(std::int64_t)>& consume) {
  std::int64_t next = 0;
  const auto take = [&](tbb::flow_control& control) -> std::int64_t {
    if (next == count || !is_wanted()) {
      control.stop();
      return count;
    }
    return next++;
  };
  const auto run_make = [&](std::int64_t i) -> std::int64_t {
    if (is_wanted()) make(i);
    return i;
  };
  const auto run_consume = [&](std::int64_t i) {
    if (is_wanted()) consume(i);
  };
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_pipeline(
        static_cast<std::size_t>(window),
        tbb::make_filter<void, std::int64_t>(tbb::filter_mode::serial_in_order, take) &
            tbb::make_filter<std::int64_t, std::int64_t>(tbb::filter_mode::parallel, run_make) &
            tbb::make_filter<std::int64_t, void>(tbb::filter_mode::serial_in_order, run_consume));
  });
}

}  // namespace terracast::core::backend

#endif
