#include "app/audit/audit_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/cli/digest.h"
#include "app/cli/output_file.h"
#include "core/error.h"
#include "core/text.h"

namespace knuckle::audit {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using cli::sha256;

constexpr std::string_view kBegin = "audit-", kEnd = ".jsonl";
constexpr std::size_t kDigits = 6, kHashSize = 64;
constexpr int kDeepest = 16;  // arrays and objects inside each other; printing them recurses

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string text_at(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : "";
}
std::uint64_t number_at(const Json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

/// Reading a pipe would wait for its writer. @throws InputError
void check_regular(const std::string& file) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(file, error)) || error) throw InputError(file + ": is no regular file");
}

/// From the last line back: a line that lacks no more than its line feed may itself look like a `resumed` one.
void mark_unfinished(std::vector<Line>& lines) {
  for (std::size_t at = lines.size(); at-- > 0;) {
    const auto& link = lines[at].link;
    if (!link || link->event != kResumedEvent) continue;
    std::size_t begin = at, size = 0;
    while (begin > 0 && size <= link->torn_bytes) size += lines[--begin].text.size() + 1;
    if (size != link->torn_bytes + 1) continue;
    std::string torn;
    for (std::size_t i = begin; i < at; ++i) torn += (i > begin ? "\n" : "") + lines[i].text;
    if (sha256(torn) != link->torn_sha256) continue;
    for (; begin < at; ++begin) lines[begin] = {std::move(lines[begin].text), std::nullopt, true};
  }
}

}  // namespace

std::string hash_before_all() {
  return std::string(kHashSize, '0');
}

std::string file_of(const std::string& folder, std::uint64_t number) {
  return fmt::format("{}/{}{:06}{}", folder, kBegin, number, kEnd);
}

const char* kept_name(const fs::path& place) {
  const std::string name = place.filename().string();
  const bool kept = name == "head" || (name.starts_with(kBegin) && name.ends_with(kEnd));
  return kept ? "is named like a file of an audit trail" : nullptr;
}

std::string head_file_of(const std::string& folder) {
  return folder + "/head";
}

std::vector<std::uint64_t> file_numbers(const std::string& folder) {
  std::error_code error;
  std::vector<std::uint64_t> numbers;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (name.size() < kBegin.size() + kDigits + kEnd.size() || !name.starts_with(kBegin) || !name.ends_with(kEnd))
      continue;
    const auto number =
        number_in(std::string_view(name).substr(kBegin.size(), name.size() - kBegin.size() - kEnd.size()));
    if (number) numbers.push_back(*number);
  }
  if (error) throw InputError(folder + ": cannot be read: " + error.message());
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

FileContent read_lines(const std::string& file) {
  check_regular(file);
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error || size > kLargestFile_bytes)
    throw InputError(fmt::format("{}: is larger than {} MB", file, kLargestFile_bytes >> 20));
  std::ifstream in(file, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  if (!in && !in.eof()) throw InputError(file + ": cannot be read");
  FileContent content;
  std::size_t begin = 0;
  for (std::size_t end = all.find('\n'); end != std::string::npos; end = all.find('\n', begin)) {
    std::string text = all.substr(begin, end - begin);
    std::optional<Link> link = link_of(text);
    content.lines.push_back({std::move(text), std::move(link)});
    begin = end + 1;
  }
  content.rest = all.substr(begin);
  mark_unfinished(content.lines);
  return content;
}

std::optional<Link> link_of(const std::string& line) {
  bool too_deep = false;
  const auto look = [&](int depth, Json::parse_event_t, const Json&) {
    too_deep = too_deep || depth > kDeepest;
    return !too_deep;
  };
  const Json json = Json::parse(line, look, false);
  if (too_deep || !json.is_object()) return std::nullopt;
  Link link{number_at(json, "n"),        text_at(json, "before"),   text_at(json, "event"),
            number_at(json, "file"),     number_at(json, "oldest"), number_at(json, "torn_bytes"),
            text_at(json, "torn_sha256")};
  if (link.number == 0 || link.before.size() != kHashSize || link.event.empty()) return std::nullopt;
  return link;
}

std::string head_text(const Head& head) {
  return fmt::format("{:020} {}\n", head.number, head.hash);  // always of the same length: written in place
}

std::optional<Head> read_head(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(head_file_of(folder), error))) return std::nullopt;
  check_regular(head_file_of(folder));
  std::ifstream in(head_file_of(folder));
  std::string number, hash;
  if (!(in >> number >> hash) || hash.size() != kHashSize) return std::nullopt;
  const auto value = number_in(number);
  if (!value) return std::nullopt;
  return Head{*value, hash};
}

namespace {

class Checker {
 public:
  explicit Checker(const std::string& folder) : folder_(folder), head_(read_head(folder)) {}

  Check run() {
    const std::vector<std::uint64_t> numbers = file_numbers(folder_);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (i > 0 && numbers[i] != numbers[i - 1] + 1) {
        broken(file_of(folder_, numbers[i - 1] + 1), 0, "is missing");
        before_.reset();
      }
      ++check_.files;
      check_file(numbers[i], i + 1 == numbers.size());
    }
    check_end();
    if (!numbers.empty()) check_begin(numbers.front());
    return std::move(check_);
  }

 private:
  void broken(const std::string& file, std::size_t line, const std::string& why) {
    if (file == broken_file_) return;
    broken_file_ = file;
    check_.breaks.push_back(line == 0 ? file + ": " + why : fmt::format("{}:{}: {}", file, line, why));
  }

  void check_file(std::uint64_t number, bool newest) {
    const std::string file = file_of(folder_, number);
    const FileContent content = read_lines(file);
    const std::vector<Line>& lines = content.lines;
    const bool may_be_unfinished = newest && head_;  // Programs write a head before their first line.
    std::size_t end = lines.size();
    while (may_be_unfinished && end > 0 && !lines[end - 1].link) --end;
    bool has_header = false, in_unfinished = false;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto& [text, link, unfinished] = lines[i];
      const bool goes_on = std::exchange(in_unfinished, unfinished || i >= end);
      if (in_unfinished) {
        if (!goes_on) note_unfinished(file, i + 1);
      } else if (!link) {
        broken(file, i + 1, "is no line of an audit trail");
      } else {
        if (link->event == kResumedEvent && (i == 0 || !lines[i - 1].unfinished))
          broken(file, i + 1, "names an unfinished line before it, which is not there as it was");
        if (link->event == kFileEvent && link->file == number) has_header = true;
        // Rotation takes whole files away.
        if ((!has_header && link->event != kResumedEvent) || (number == 1 && check_.lines.empty() && link->number != 1))
          broken(file, i + 1, "is not the first line of its file: lines before it were removed");
        check_line(file, i + 1, text, *link);
      }
    }
    if (content.rest.empty() || (in_unfinished && may_be_unfinished)) return;
    const std::size_t line = lines.size() + 1;
    if (may_be_unfinished) return note_unfinished(file, line);
    broken(file, line,
           newest ? "is no line of an audit trail" : "ends in the middle of a line, although another file follows");
  }

  void note_unfinished(const std::string& file, std::size_t line) {
    check_.notes.push_back(fmt::format(
        "{}:{}: unfinished: the program was killed, the disk was full, or it is being written", file, line));
  }

  void check_line(const std::string& file, std::size_t at, const std::string& line, const Link& link) {
    if (link.number == 1 && !before_ && link.before != hash_before_all())
      broken(file, at, "names a line before the first");
    if (before_ && link.number != before_->number + 1)
      broken(file, at, fmt::format("has number {} after {}", link.number, before_->number));
    if (before_ && link.before != before_->hash)
      broken(file, at, "does not name the hash of the line before: one of the two was changed");
    if (check_.lines.empty()) first_number_ = link.number;
    if (link.event == kFileEvent) oldest_ = link.oldest;
    if (link.event == kMissingEvent)
      broken(file, at, "lines before it were removed or changed while no program wrote here");
    check_.lines.push_back(line);
    before_ = check_.last = {link.number, cli::sha256(line)};
    if (head_ && head_->number == link.number && head_->hash != check_.last.hash)
      broken(file, at, "is not the line that was written: its hash is another in " + head_file_of(folder_));
  }

  /// Rotation removes the oldest files, and says so in the first line of the newest.
  void check_begin(std::uint64_t oldest_there) {
    if (oldest_there > oldest_)
      return broken(file_of(folder_, oldest_there - 1), 0, "is missing, and was not removed by rotation");
    if (first_number_ > 1)
      check_.notes.push_back(fmt::format("begins with line {}: older files were removed by rotation", first_number_));
  }

  void check_end() {
    const std::string head = head_file_of(folder_);
    if (!head_ && check_.last.number > 0) return broken(head, 0, "is missing, or not as it was written");
    if (head_ && head_->number > check_.last.number)
      broken(head, 0,
             fmt::format("lines {} to {} were written, and are not there", check_.last.number + 1, head_->number));
  }

  std::string folder_;
  std::optional<Head> head_;
  Check check_;
  std::optional<Head> before_;  // the line before the next one, as far as it is known
  std::string broken_file_;     // the newest
  std::uint64_t oldest_ = 1, first_number_ = 0;
};

}  // namespace

Check check_trail(const std::string& folder) {
  return Checker(folder).run();
}

std::string readable(const std::string& line) {
  const auto json = nlohmann::ordered_json::parse(line);
  const auto utc = json.find("utc");
  std::string text = utc != json.end() && utc->is_string() ? utc->get<std::string>() : "?";
  text += " " + json.at("event").get<std::string>();
  const char* between = ": ";
  for (const auto& [key, value] : json.items()) {
    if (key == "n" || key == "utc" || key == "mono_s" || key == "event" || key == "before") continue;
    text += between + key + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
    between = ", ";
  }
  return printable(text);
}

namespace {

struct Options {
  std::string folder;
  bool json = false, quiet = false;
};

int run(const Options& o) {
  if (o.json && o.quiet) cli::refuse_option("--json", "", "does not go with --quiet, which prints no lines");
  const Check check = check_trail(o.folder);
  if (check.files == 0 && !read_head(o.folder)) throw InputError(o.folder + ": no audit trail is there");
  if (o.json) {
    cli::OutputFile out("standard output", "-");
    for (const std::string& line : check.lines) out.stream() << line << '\n';
    out.commit();
  } else if (!o.quiet) {
    for (const std::string& line : check.lines) std::cout << readable(line) << '\n';
  }
  std::cout << std::flush;
  if (!std::cout) throw InputError("standard output: cannot be written");
  for (const std::string& note : check.notes) std::cerr << "knuckle audit: " << note << '\n';
  for (const std::string& broken : check.breaks) std::cerr << "knuckle audit: BROKEN: " << broken << '\n';
  if (!check.breaks.empty()) return 1;
  if (check.lines.empty()) {
    std::cerr << "knuckle audit: whole, and empty: no line has been written\n";
    return 0;
  }
  std::cerr << fmt::format(
      "knuckle audit: whole: {} lines in {} files; the last is {} with hash {}: keep a note of it "
      "elsewhere\n",
      check.lines.size(), check.files, check.last.number, check.last.hash);
  return 0;
}

}  // namespace

cli::Command audit_entry() {
  return cli::command<Options>(
      "audit", "Print an audit trail of the machine's side, and check that nobody has changed it",
      [](const cli::OptionList& command, Options& o) {
        command.add_option("FOLDER", o.folder, "Of the trail (knuckle slave --audit)").required();
        command.add_flag("--json", o.json, "Print the lines as they are in the files");
        command.add_flag("--quiet", o.quiet, "Print the result only");
      },
      run);
}

}  // namespace knuckle::audit
