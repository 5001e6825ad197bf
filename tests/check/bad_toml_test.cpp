// Whatever a user's file holds, its loader refuses it in one line with the file's name.
#include "tests/support/bad_toml.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "app/battery/settings.h"
#include "app/recordings/csv_mapping.h"
#include "app/session/link_file.h"
#include "app/session/scenario.h"
#include "app/session/truth_file.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::checking {
namespace {

TEST(BadToml, OfEveryKindIsRefusedByItsLoaderInOneLineThatNamesTheFile) {
  const std::string config = test::source_dir() + "/config/";
  const MachineDescription machine = load_machine(config + "machines/solar015.toml");
  using Load = std::function<void(const std::string&)>;
  const std::vector<std::pair<std::string, Load>> all{
      {"machines/solar015.toml", [](const auto& path) { (void)load_machine(path); }},
      {"devices/knuckle1.toml", [](const auto& path) { (void)load_device(path); }},
      {"scenarios/dismantle.toml", [&](const auto& path) { (void)session::load_scenario(path, machine); }},
      {"links/lte.toml", [](const auto& path) { (void)session::load_link(path); }},
      {"truth/example.toml", [&](const auto& path) { (void)session::load_truth(path, machine); }},
      {"maps/knuckle_recording.toml", [](const auto& path) { (void)recordings::read_mapping(path); }},
      {"grids/feel.toml", [](const auto& path) { (void)battery::load_settings(path); }},
  };
  const test::TemporaryFolder folder;
  for (const auto& [file, load] : all) {
    SCOPED_TRACE(file);
    const std::string path = folder.file("bad.toml"), good = test::content(config + file);
    const bool nothing_is_needed = file.starts_with("links/") || file.starts_with("truth/");
    test::expect_bad_tomls_refused(
        path, good, [&] { load(path); }, nothing_is_needed);
  }
}

}  // namespace
}  // namespace knuckle::checking
