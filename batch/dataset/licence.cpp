#include "batch/dataset/licence.h"

#include <algorithm>
#include <array>

namespace terracast::batch {

namespace {

struct KnownLicence {
  std::string_view spdx;
  std::string_view hugging_face;
};

/// Licences under which data is published, and what each is called at Hugging Face.
constexpr std::array kKnown = {
    KnownLicence{"Apache-2.0", "apache-2.0"},
    KnownLicence{"CC-BY-2.0", "cc-by-2.0"},
    KnownLicence{"CC-BY-3.0", "cc-by-3.0"},
    KnownLicence{"CC-BY-4.0", "cc-by-4.0"},
    KnownLicence{"CC-BY-NC-2.0", "cc-by-nc-2.0"},
    KnownLicence{"CC-BY-NC-3.0", "cc-by-nc-3.0"},
    KnownLicence{"CC-BY-NC-4.0", "cc-by-nc-4.0"},
    KnownLicence{"CC-BY-NC-ND-4.0", "cc-by-nc-nd-4.0"},
    KnownLicence{"CC-BY-NC-SA-3.0", "cc-by-nc-sa-3.0"},
    KnownLicence{"CC-BY-NC-SA-4.0", "cc-by-nc-sa-4.0"},
    KnownLicence{"CC-BY-ND-4.0", "cc-by-nd-4.0"},
    KnownLicence{"CC-BY-SA-3.0", "cc-by-sa-3.0"},
    KnownLicence{"CC-BY-SA-4.0", "cc-by-sa-4.0"},
    KnownLicence{"CC0-1.0", "cc0-1.0"},
    KnownLicence{"CDLA-Permissive-1.0", "cdla-permissive-1.0"},
    KnownLicence{"CDLA-Permissive-2.0", "cdla-permissive-2.0"},
    KnownLicence{"CDLA-Sharing-1.0", "cdla-sharing-1.0"},
    KnownLicence{"MIT", "mit"},
    KnownLicence{"ODC-By-1.0", "odc-by"},
    KnownLicence{"ODbL-1.0", "odbl"},
    KnownLicence{"PDDL-1.0", "pddl"},
};

bool is_same(std::string_view a, std::string_view b) {
  const auto lower = [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

LicenceNames licence_names(std::string_view licence) {
  for (const KnownLicence& known : kKnown)
    if (is_same(known.spdx, licence))
      return {std::string(known.hugging_face),
              "https://spdx.org/licenses/" + std::string(known.spdx) + ".html"};
  return {"other", ""};
}

}  // namespace terracast::batch
