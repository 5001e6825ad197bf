// What may stand in a TOML file instead of what should: each loader is given the same.
#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "core/text.h"
#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {

struct BadToml {
  std::string what, text;
};

/// Made of a good one; each must be refused. Of every line "key = value" whose value is a number, a word or a text:
/// the key twice, a table instead of the value, and instead of a number what is none.
inline std::vector<BadToml> bad_tomls(const std::string& good) {
  const auto times = [](std::size_t n, const std::string& part) {
    std::string all;
    for (std::size_t i = 0; i < n; ++i) all += part;
    return all;
  };
  std::string bytes;
  for (int i = 0; i < 1024; ++i) bytes += static_cast<char>(i * 7);
  std::vector<BadToml> all{{"bytes", bytes},
                           {"zeros", std::string(4096, '\0')},
                           {"10 MB", good + times(1'000'000, "# comment\n")},
                           {"arrays within arrays", "a = " + std::string(100'000, '[')},
                           {"tables within tables", "a = " + times(100'000, "{a = ")},
                           {"a deep name", "[a" + times(100'000, ".a") + "]\n"},
                           {"another key", "not_a_key_of_this_file = 1\n" + good},
                           {"no TOML", "<html>\n"},
                           {"no end of a text", "a = \"x\n" + good}};
  std::vector<std::string> lines;
  std::istringstream in(good);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const auto with = [&](std::size_t changed, const std::string& line) {
    std::string text;
    for (std::size_t i = 0; i < lines.size(); ++i) text += (i == changed ? line : lines[i]) + '\n';
    return text;
  };
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t equals = lines[i].find(" = ");
    if (equals == std::string::npos || std::isalpha(static_cast<unsigned char>(lines[i][0])) == 0) continue;
    const std::string key = lines[i].substr(0, equals);
    const char first = lines[i][equals + 3];
    if (first == '[' || first == '{') continue;
    all.push_back({key + " twice", with(i, lines[i] + '\n' + lines[i])});
    all.push_back({key + " of a wrong type", with(i, key + " = { a = [1979-05-27] }")});
    if (first == '"' || std::isalpha(static_cast<unsigned char>(first)) != 0) continue;
    for (const char* none : {"nan", "inf", "\"1\""}) all.push_back({key + " = " + none, with(i, key + " = " + none)});
  }
  return all;
}

/// Each of them is refused in one line that begins with the file, and no other exception is thrown.
/// @param empty_is_good an empty file is one of the loader's.
inline void expect_bad_tomls_refused(const std::string& path, const std::string& good,
                                     const std::function<void()>& load, bool empty_is_good = false) {
  const auto said = [&](const std::string& text) {
    std::filesystem::remove(path);  // a file that is made anew is not waited for by the disk, a shortened one is
    std::ofstream(path, std::ios::binary) << text;
    std::filesystem::permissions(path, std::filesystem::perms(0600));
    return refusal(load);
  };
  ASSERT_EQ(said(good), "accepted");
  std::vector<BadToml> all = bad_tomls(good);
  EXPECT_GT(all.size(), 11U) << "lines of the good file are found";
  if (!empty_is_good) all.push_back({"nothing", ""});
  for (const BadToml& bad : all) {
    const std::string line = said(bad.text);
    EXPECT_EQ(line.rfind(path + ":", 0), 0U) << path << ", " << bad.what << ": " << line.substr(0, 300);
    EXPECT_EQ(printable(line), line) << bad.what;
  }
}

}  // namespace knuckle::test
