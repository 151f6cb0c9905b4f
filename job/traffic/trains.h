#pragma once

#include <memory>
#include <span>
#include <vector>

#include "job/traffic/proposals.h"
#include "job/traffic/tally.h"
#include "job/traffic/traffic.h"
#include "job/traffic/train.h"

namespace terracast::job {

/// The trains of proposals, each on a way that lasts, in the order of their keys: none nearer to another on its track than
/// the headway of its railway, and none that faces another there.
std::vector<std::unique_ptr<Train>> make_trains(std::span<const TrainProposal> proposals,
                                                const TrafficSite& site, double duration_s,
                                                Tally& tally);

}  // namespace terracast::job
