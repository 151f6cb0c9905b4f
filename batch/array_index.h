#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

namespace terracast::batch {

/// One of the parts that a job's shards are dealt to.
struct Part {
  int index = 0;  ///< from 0
  int count = 1;
  bool operator==(const Part&) const = default;
};

/// Where part `index` of `num_parts` of so many things in a row begins: the parts lie side by side
/// and cover the row, and part num_parts begins at its end.
int part_begin(std::size_t num_things, int index, int num_parts);

/// throws Usage: not INDEX/COUNT, or an index that is not below the count
Part part_from_text(const std::string& text);

/// What a queue tells its tasks of themselves: SLURM_ARRAY_TASK_ID with _MIN, _MAX, _STEP, _COUNT;
/// SGE_TASK_ID with _FIRST, _LAST, _STEPSIZE; PBS_ARRAY_INDEX (or PBS_ARRAYID); JOB_COMPLETION_INDEX
/// of a Kubernetes Indexed Job. The last two do not tell how many tasks there are.
/// variable   looks up an environment variable
/// count      how many tasks there are, where the queue does not tell, or where only some of them are in its array, which
///            are counted from 0 then; 0: not known
/// returns    nothing outside of an array
/// throws     Usage: the count is needed, contradicts the queue's, or is given outside of an array; an array with holes,
///            whose missing parts nobody would do; numbers that make no sense
std::optional<Part> part_from_queue(
    const std::function<std::optional<std::string>(const char*)>& variable, int count);

}  // namespace terracast::batch
