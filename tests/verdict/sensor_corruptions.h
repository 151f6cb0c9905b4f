#pragma once

#include <vector>

#include "tests/verdict/corruptions.h"

/// Mistakes in the samples of sensors beside cameras, in each sequence of a dataset of any format.
namespace terracast::test {

/// Those that any flight shows, however short.
std::vector<Corruption> plain_sensor_corruptions();
/// Those that want a flight that turns and frames that follow each other closely.
std::vector<Corruption> subtle_sensor_corruptions();

}  // namespace terracast::test
