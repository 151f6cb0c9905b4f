#include "tiler/objects/model_mtl.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tiler/objects/model_statements.h"

namespace terracast::tiler {
namespace {

using core::KnownName;

constexpr const char* kShine = "how a surface shines is left to its kind";
constexpr const char* kOpaque = "surfaces are opaque; a colour's alpha shows the colour behind";
constexpr const char* kRelief = "surfaces are as fine as their triangles";

constexpr auto kNames = std::to_array<KnownName>({
    {"MTL newmtl", "name of a material"},
    {"MTL Kd", "colour, as a screen shows it (sRGB)"},
    {"MTL map_Kd", "picture of the surface"},
    {"MTL map_Kd -s", "how often the picture repeats"},
    {"MTL map_Kd -o", "where the picture begins"},
    {"MTL map_Kd -clamp", "whether the picture repeats"},
    {"MTL map_Kd -blendu", "how a program makes coarser levels", false},
    {"MTL map_Kd -blendv", "how a program makes coarser levels", false},
    {"MTL map_Kd -boost", "how a program makes coarser levels", false},
    {"MTL map_Kd -texres", "how a program makes coarser levels", false},
    {"MTL map_Kd -bm", "of maps of bumps", false},
    {"MTL map_Kd -imfchan", "of maps of one channel", false},
    {"MTL map_Kd -type", "of maps of what mirrors show", false},
    {"MTL map_Kd -mm", "pictures are shown with the values that they have", false},
    {"MTL map_Kd -cc", "pictures are shown with the values that they have", false},
    {"MTL map_Kd -t", "pictures lie still", false},
    {"MTL d", "whether a material counts as let through by light"},
    {"MTL Tr", "the same as 1 - d, where there is no d"},
    {"MTL Ka", "light is the sky's", false},
    {"MTL map_Ka", "light is the sky's", false},
    {"MTL Ks", kShine, false},
    {"MTL map_Ks", kShine, false},
    {"MTL Ns", kShine, false},
    {"MTL map_Ns", kShine, false},
    {"MTL Ni", kShine, false},
    {"MTL sharpness", kShine, false},
    {"MTL illum", kShine, false},
    {"MTL refl", kShine, false},
    {"MTL map_refl", kShine, false},
    {"MTL Pr", kShine, false},
    {"MTL map_Pr", kShine, false},
    {"MTL Pm", kShine, false},
    {"MTL map_Pm", kShine, false},
    {"MTL Ps", kShine, false},
    {"MTL map_Ps", kShine, false},
    {"MTL Pc", kShine, false},
    {"MTL Pcr", kShine, false},
    {"MTL aniso", kShine, false},
    {"MTL anisor", kShine, false},
    {"MTL Ke", "surfaces of models give no light", false},
    {"MTL map_Ke", "surfaces of models give no light", false},
    {"MTL Tf", kOpaque, false},
    {"MTL map_d", kOpaque, false},
    {"MTL map_Tr", kOpaque, false},
    {"MTL map_opacity", kOpaque, false},
    {"MTL bump", kRelief, false},
    {"MTL map_bump", kRelief, false},
    {"MTL norm", kRelief, false},
    {"MTL map_norm", kRelief, false},
    {"MTL disp", kRelief, false},
    {"MTL map_disp", kRelief, false},
    {"MTL decal", "pictures of other kinds than map_Kd are not mixed with it", false},
    {"MTL map_aat", "edges of pictures are smooth always", false},
});

/// Options of a map, and how many words follow them: at least, and at most where they are numbers.
struct Option {
  std::string_view name;
  std::size_t least, most;
};
constexpr std::array<Option, 13> kOptions = {{{"-blendu", 1, 1},
                                              {"-blendv", 1, 1},
                                              {"-boost", 1, 1},
                                              {"-bm", 1, 1},
                                              {"-cc", 1, 1},
                                              {"-clamp", 1, 1},
                                              {"-imfchan", 1, 1},
                                              {"-mm", 2, 2},
                                              {"-o", 1, 3},
                                              {"-s", 1, 3},
                                              {"-t", 1, 3},
                                              {"-texres", 1, 1},
                                              {"-type", 1, 1}}};

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](char c) { return lower(c); });
  return out;
}

/// As the table has it, whatever its case; as it stands where the table has it not.
std::string name_of(std::string_view statement) {
  const std::string whole = fmt::format("MTL {}", statement);
  for (const KnownName& known : kNames)
    if (lower(known.name) == lower(whole)) return std::string(known.name);
  return whole;
}

/// Words of a map's statement, each with where what follows it begins.
class MapWords {
 public:
  explicit MapWords(std::string_view rest) : rest_(rest) {}

  std::string_view peek() const {
    const std::size_t end = std::min(rest_.find_first_of(" \t"), rest_.size());
    return rest_.substr(0, end);
  }
  std::string_view take() {
    const std::string_view word = peek();
    rest_.remove_prefix(word.size());
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\t'))
      rest_.remove_prefix(1);
    return word;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

class MtlReader {
 public:
  MtlReader(const std::filesystem::path& folder_of_library, const ModelFolder& folder,
            std::map<std::string, MtlMaterial>& materials, core::Ledger& ledger)
      : folder_of_library_(folder_of_library),
        folder_(folder),
        materials_(materials),
        ledger_(ledger) {}

  void take(const ModelStatement& statement) {
    if (statement.name.starts_with('#')) return;
    const std::string name = name_of(statement.name);
    ledger_.count(name, kNames);
    if (name == "MTL newmtl") {
      material_ = &materials_[std::string(statement.rest)];
      *material_ = {};
      has_d_ = false;
      return;
    }
    const core::KnownName* known = core::find_known(kNames, name);
    if (known == nullptr || !known->is_used) return;
    if (material_ == nullptr) {
      ledger_.misunderstand(name, "before any newmtl");
      return;
    }
    if (name == "MTL Kd") take_kd(statement.rest);
    if (name == "MTL map_Kd") take_map(statement.rest);
    if (name == "MTL d" || name == "MTL Tr") take_opacity(name, statement.rest);
  }

 private:
  void take_kd(std::string_view rest) {
    const std::vector<std::string_view> words = words_of(rest);
    std::vector<double> values;
    for (const std::string_view word : words)
      if (const auto value = number_of(word); value && std::isfinite(*value) && *value >= 0.0)
        values.push_back(*value);
    if (values.size() != words.size() || (values.size() != 1 && values.size() != 3)) {
      ledger_.misunderstand("MTL Kd", rest);
      return;
    }
    if (values.size() == 1) values.resize(3, values[0]);  // a grey
    material_->kd_srgb = Eigen::Array3d(values[0], values[1], values[2]).min(1.0);
    for (const double value : values)
      if (value > 1.0) ledger_.misunderstand("MTL Kd", rest);
  }

  void take_opacity(const std::string& name, std::string_view rest) {
    std::vector<std::string_view> words = words_of(rest);
    if (!words.empty() && words[0] == "-halo") words.erase(words.begin());
    const auto value = words.size() == 1 ? number_of(words[0]) : std::nullopt;
    if (!value) {
      ledger_.misunderstand(name, rest);
      return;
    }
    if (name == "MTL d") {
      has_d_ = true;
      material_->is_see_through = *value < 1.0;
    } else if (!has_d_) {
      material_->is_see_through = *value > 0.0;
    }
  }

  void take_map(std::string_view rest) {
    MtlPicture picture;
    MapWords words(rest);
    while (words.peek().starts_with('-')) {
      const auto option = std::find_if(kOptions.begin(), kOptions.end(), [&](const Option& one) {
        return one.name == lower(words.peek());
      });
      if (option == kOptions.end()) break;  // a picture's name may begin so
      words.take();
      ledger_.count("MTL map_Kd " + std::string(option->name), kNames);
      take_option(option->name, values_of(*option, words), picture);
    }
    picture.name = words.rest();
    if (picture.name.size() > 2 && picture.name.front() == '"' && picture.name.back() == '"')
      picture.name = picture.name.substr(1, picture.name.size() - 2);
    if (picture.name.empty()) {
      ledger_.misunderstand("MTL map_Kd", rest);
      return;
    }
    picture.file = path_of(picture.name);
    material_->picture = std::move(picture);
  }

  static std::vector<std::string_view> values_of(const Option& option, MapWords& words) {
    std::vector<std::string_view> values;
    while (values.size() < option.most && !words.peek().empty() &&
           (values.size() < option.least || number_of(words.peek())))
      values.push_back(words.take());
    return values;
  }

  void take_option(std::string_view name, const std::vector<std::string_view>& values,
                   MtlPicture& picture) {
    const auto wrong = [&] {
      ledger_.misunderstand(fmt::format("MTL map_Kd {}", name),
                            fmt::format("{}", fmt::join(values, " ")));
    };
    if (name == "-clamp") picture.repeats = values.empty() || lower(values[0]) != "on";
    if (name != "-s" && name != "-o") return;
    Eigen::Vector2d& pair = name == "-s" ? picture.scale : picture.offset;
    for (std::size_t k = 0; k < std::min<std::size_t>(values.size(), 2); ++k) {
      const auto value = number_of(values[k]);
      if (!value || !std::isfinite(*value)) return wrong();
      pair[static_cast<int>(k)] = *value;
    }
  }

  /// In the library's folder, or the model's where it is not there.
  std::filesystem::path path_of(const std::string& name) const {
    const std::string where = fmt::format("{}: texture {}", folder_.name(), name);
    if (!folder_of_library_.empty() && !ModelFolder::is_absolute(name)) {
      const std::filesystem::path by_library =
          folder_.path_of(folder_of_library_.generic_string() + "/" + name, where);
      std::error_code error;
      if (std::filesystem::is_regular_file(by_library, error)) return by_library;
    }
    return folder_.path_or_beside(name, where);
  }

  const std::filesystem::path& folder_of_library_;
  const ModelFolder& folder_;
  std::map<std::string, MtlMaterial>& materials_;
  core::Ledger& ledger_;
  MtlMaterial* material_ = nullptr;
  bool has_d_ = false;
};

}  // namespace

std::span<const KnownName> mtl_names() { return kNames; }

void read_mtl(std::span<const std::byte> bytes, const std::filesystem::path& folder_of_library,
              const ModelFolder& folder, std::map<std::string, MtlMaterial>& materials,
              core::Ledger& ledger) {
  MtlReader reader(folder_of_library, folder, materials, ledger);
  each_statement(bytes, [&](const ModelStatement& statement) { reader.take(statement); });
}

}  // namespace terracast::tiler
