#pragma once

#include <string>
#include <string_view>

namespace terracast::batch {

/// A licence as those who list datasets name it.
struct LicenceNames {
  std::string hugging_face;  ///< "other" when it is none of those that are known there
  std::string url;           ///< its page at SPDX; empty when it is not known
};

/// licence   an SPDX identifier, in any case of letters, or another name
LicenceNames licence_names(std::string_view licence);

}  // namespace terracast::batch
