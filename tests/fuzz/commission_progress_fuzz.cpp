// Any file as the progress of a commissioning, as it is and sealed as the program itself would seal it: refused in one
// line, or a progress that says the same when it is written again.
#include <cstdint>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "app/bringup/commission_command.h"
#include "app/cli/digest.h"
#include "tests/fuzz/folder_in_memory.h"
#include "tests/fuzz/require.h"

namespace {

using namespace knuckle;
using Json = nlohmann::ordered_json;
using knuckle::test::refused_or;
using knuckle::test::require;
using knuckle::test::require_line;

const bringup::ProgressOf kOf{"can0", "abc123"};

std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string sealed(Json json) {
  json.erase("sha256");
  json["sha256"] = cli::sha256(json.dump());
  return json.dump(1) + '\n';
}

/// What the program writes, with this in the place of what was found; empty: it is nothing that can be put there.
std::string with_progress(const std::string& written, std::string_view progress) {
  constexpr int kDeepest = 32;  // what is nested deeper is tried without a seal
  const auto shallow = [](int depth, Json::parse_event_t, const Json&) { return depth <= kDeepest; };
  Json json = Json::parse(written);
  require(sealed(json) == written);
  json["progress"] = Json::parse(progress, shallow, false);
  try {
    return json["progress"].is_discarded() ? "" : sealed(json);
  } catch (const Json::exception&) {
    return "";  // text that is not UTF-8
  }
}

void check(const test::FolderInMemory& folder, const std::string& text) {
  folder.put("tried", text);
  const bringup::WizardProgress read = bringup::read_progress(folder.path() + "/tried", kOf);
  require(read.completed >= 0 && read.completed <= bringup::kDeadBands);
  for (const bringup::Finding& one : read.findings)
    if (!one.text.empty()) require_line(one.text);
  const std::string first = folder.path() + "/first", second = folder.path() + "/second";
  bringup::write_progress(first, read, kOf);
  bringup::write_progress(second, bringup::read_progress(first, kOf), kOf);
  require(text_of(first) == text_of(second));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const test::FolderInMemory folder;
  static const std::string written = [] {
    bringup::write_progress(folder.path() + "/written", {}, kOf);
    return text_of(folder.path() + "/written");
  }();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  refused_or([&] { check(folder, std::string(text)); });
  if (const std::string whole = with_progress(written, text); !whole.empty()) refused_or([&] { check(folder, whole); });
  return 0;
}
