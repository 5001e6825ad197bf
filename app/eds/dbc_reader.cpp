// The statements of a DBC file, one after the other.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "app/eds/dbc_checks.h"
#include "app/eds/dbc_file.h"
#include "app/eds/dbc_text.h"
#include "app/recordings/csv_cells.h"
#include "core/error.h"
#include "core/text.h"
#include "machine/file_text.h"
#include "transport/j1939.h"

namespace knuckle::eds {
namespace {

constexpr std::size_t kLargestDbc_MB = 16, kMostSlips = 10000, kLongestName = 128;
constexpr std::size_t kMostSignals = 1000;  // of a message: each is held against each
constexpr std::size_t kMostRanges = 256;    // of a multiplexed signal
constexpr unsigned kMostBits = 64;          // of a number
constexpr double kLongest_ms = 3.6e6, kLargest = 1e300;
constexpr std::uint32_t kNoMessage = 0x4000'0000;  // VECTOR__INDEPENDENT_SIG_MSG: signals that no message has
constexpr const char* kNobody = "Vector__XXX";
constexpr const char* kPeriodAttribute = "GenMsgCycleTime";
constexpr const char* kFormatAttribute = "VFrameFormat";
constexpr const char* kKindAttribute = "SigType";  // of J1939
constexpr const char* kCounterKind = "MessageCounter";
constexpr const char* kChecksumKind = "MessageChecksum";

/// What statements begin with: BO_, SIG_VALTYPE_, VERSION.
bool is_keyword(std::string_view word) {
  return word == "VERSION" ||
         (word.size() > 2 && word.ends_with('_') &&
          std::all_of(word.begin(), word.end(), [](char c) { return c == '_' || (c >= 'A' && c <= 'Z'); }));
}

/// Line ends of every computer become '\n', and the rest UTF-8.
std::string plain_text(std::string_view bytes) {
  const std::string text = recordings::to_utf8(std::string(bytes)).utf8;
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\r')
      plain += text[i];
    else if (i + 1 == text.size() || text[i + 1] != '\n')
      plain += '\n';
  }
  if (plain.ends_with('\x1a')) plain.pop_back();  // where a file of DOS ends
  return plain;
}

class DbcReader {
 public:
  DbcReader(std::string_view text, const std::string& source) : text_(plain_text(text)), scan_(text_) {
    file_.source = source;
    nobody_.unusable = "is none";
    if (text_.find('\0') != std::string::npos)
      throw InputError(source + ": is not a DBC file: it has bytes that no text has");
  }

  DbcFile read() {
    while (!scan_.done()) statement();
    if (file_.messages.empty()) throw InputError(file_.source + ": is not a DBC file: it has no message (BO_)");
    for (DbcMessage& message : file_.messages) finish(message);
    std::stable_sort(slips_.begin(), slips_.end(), [](const auto& a, const auto& b) { return a.line < b.line; });
    for (const DbcFault& slip : slips_) file_.slips.push_back(fmt::format("line {}: {}", slip.line, slip.what));
    return std::move(file_);
  }

 private:
  struct Format {
    bool j1939 = false, fd = false;
  };

  void slip(DbcFault fault) {
    slips_.push_back(std::move(fault));
    if (slips_.size() > kMostSlips)
      throw InputError(fmt::format("{}: is not a DBC file: more than {} slips", file_.source, kMostSlips));
  }
  void slip(const std::string& why) { slip({line_, fmt::format("{}: {}", key_, why)}); }
  /// Of the statement that is read.
  [[noreturn]] void refuse(const std::string& why) const { throw DbcFault{line_, fmt::format("{}: {}", key_, why)}; }
  void damage(DbcMessage& message, const DbcFault& fault) {
    slip(fault);
    if (message.unusable.empty()) message.unusable = fmt::format("line {}: {}", fault.line, fault.what);
  }

  void statement() {
    line_ = scan_.line();
    const std::string keyword(scan_.word());
    key_ = shortened(keyword);
    if (keyword != "SG_") message_ = nullptr;
    try {
      statement_of(keyword);
    } catch (const DbcFault& fault) {
      if (message_ != nullptr)
        damage(*message_, fault);
      else if (keyword == "VAL_")
        slip(fault);  // without names the numbers are the same
      else            // also where a text without end may hide what follows
        throw InputError(fmt::format("{}: line {}: {}", file_.source, fault.line, fault.what));
      do (void)scan_.rest_of_line();
      while (!scan_.done() && !is_keyword(scan_.peek_word()));
    }
    if (keyword != "BO_" && keyword != "SG_") message_ = nullptr;
  }
  void statement_of(const std::string& keyword) {
    if (keyword == "SG_") return signal();
    if (keyword == "BO_") return message();
    if (keyword == "NS_") return keywords();
    if (keyword == "CM_") return comment();
    if (keyword == "VAL_") return skip(false);
    if (keyword == "SIG_VALTYPE_") return float_type();
    if (keyword == "SG_MUL_VAL_") return multiplexer_values();
    if (keyword == "BA_DEF_") return attribute_type();
    if (keyword == "BA_DEF_DEF_") return attribute_default();
    if (keyword == "BA_") return attribute();
    if (!is_keyword(keyword)) slip("begins nothing that DBC files have: passed over");
    skip();
  }
  /// To the statement's ';', or to a line that begins with a keyword, for some statements have no ';'.
  void skip(bool has_texts_of_several_lines = true) {
    while (!scan_.done() && !scan_.accept(';')) {
      if (scan_.begins_line() && is_keyword(scan_.peek_word())) return;
      if (scan_.at('"'))
        (void)text("a text", has_texts_of_several_lines);
      else if (scan_.word().empty())
        scan_.take(1);
    }
  }
  /// NS_ : each in a line of its own.
  void keywords() {
    (void)scan_.accept(':');
    while (scan_.word_is_alone()) (void)scan_.word();
  }

  // ---- Parts of a statement

  [[noreturn]] void expected(const std::string& what) {
    if (scan_.done()) refuse("the file ends where " + what + " is expected");
    refuse(fmt::format("{} is expected at '{}'", what, shortened(scan_.rest_of_line(), 30)));
  }
  void expect(char c) {
    if (!scan_.accept(c)) expected(fmt::format("'{}'", c));
  }
  void end() {
    if (scan_.accept(';')) return;
    if (!scan_.begins_line() || !is_keyword(scan_.peek_word())) expected("';'");
    slip("has no ';' at its end");
  }
  std::string name(const std::string& what) {
    const std::string_view word = scan_.peek_word();
    if (word.empty() || word.size() > kLongestName || printable(word) != word)
      expected(fmt::format("{} of 1 to {} characters", what, kLongestName));
    return std::string(scan_.word());
  }
  std::string text(const std::string& what, bool of_several_lines = false) {
    if (!scan_.at('"')) expected(what);
    const auto text = scan_.quoted(of_several_lines);
    if (!text) refuse(what + " begins with a quote and does not end");
    return *text;
  }
  template <typename Number = std::uint64_t>
  Number number(const std::string& what, Number least, Number most) {
    const auto number = number_in<Number>(scan_.peek_word());
    if (!number || !(*number >= least && *number <= most))
      expected(fmt::format("{} within [{}, {}]", what, least, most));
    (void)scan_.word();
    return *number;
  }
  std::uint32_t identifier() { return number<std::uint32_t>("an identifier", 0, 0xFFFF'FFFF); }
  /// Whose identifier is next. @return false where there is none that can be used: the statement is of no use.
  bool of_message() {
    const std::uint32_t id = identifier();
    const auto at = messages_.find(id);
    if (at == messages_.end() && (id & ~kExtendedId) != kNoMessage) slip(fmt::format("there is no message {}", id));
    if (at == messages_.end() || !file_.messages[at->second].unusable.empty()) return false;
    message_ = &file_.messages[at->second];
    return true;
  }
  /// Of that message: the signal whose name is next.
  std::size_t of_signal() {
    const std::string signal = name("a signal's name");
    const auto at = signals_.find({message_->id, signal});
    if (at == signals_.end()) refuse(fmt::format("{} has no signal {}", message_->name, signal));
    return at->second;
  }

  // ---- Messages and signals

  /// BO_ IDENTIFIER NAME : SIZE SENDER
  void message() {
    DbcMessage message;
    message.line = line_;
    message.id = identifier();
    message.name = name("the message's name");
    key_ = "BO_ " + message.name;
    expect(':');
    message.size = number<std::uint16_t>("a size in bytes", 0, 0xFFFF);
    if (const std::string_view sender = DbcText(scan_.rest_of_line()).word(); sender != kNobody)
      message.sender = printable(sender);
    message_ = &nobody_;
    if ((message.id & ~kExtendedId) == kNoMessage) return;
    message_ = &file_.messages.emplace_back(std::move(message));
    const bool extended = (message_->id & kExtendedId) != 0;
    const std::uint32_t id = message_->id & ~kExtendedId, most = extended ? kMostExtendedId : kMostId;
    if (id > most)
      damage(*message_, {line_, fmt::format("{}: identifier {} must be at most {}{}", key_, id, most,
                                            extended ? "" : ", or 2147483648 more where it has 29 bits")});
    const auto [first, is_new] = messages_.try_emplace(message_->id, file_.messages.size() - 1);
    if (!is_new) {
      DbcMessage& other = file_.messages[first->second];
      for (DbcMessage* one : {&other, message_})
        damage(*one, {line_, fmt::format("{}: has the identifier of {} of line {}", key_, other.name, other.line)});
    }
    if (message_->unusable.empty() && message_->size > (extended ? j1939::kMostMessage : sizeof(CanFrame::data)))
      message_->unusable = too_long(*message_);
  }
  static std::string too_long(const DbcMessage& message) {
    return fmt::format(
        "line {}: BO_ {}: has {} bytes, and a frame of classic CAN at most {}; in several packets come groups of J1939 "
        "alone (VFrameFormat J1939PG), of at most {}",
        message.line, message.name, message.size, sizeof(CanFrame::data), j1939::kMostMessage);
  }

  /// SG_ NAME [M | mN | mNM] : START|BITS@ORDER SIGN (SCALE,OFFSET) [LEAST|MOST] "UNIT" RECEIVERS
  void signal() {
    if (message_ == nullptr) refuse("stands behind no message (BO_)");
    if (!message_->unusable.empty()) return (void)scan_.rest_of_line();
    DbcSignal signal;
    signal.line = line_;
    signal.name = name("the signal's name");
    key_ = fmt::format("SG_ {} of {}", signal.name, message_->name);
    if (message_->signals.size() == kMostSignals) refuse(fmt::format("is one of more than {}", kMostSignals));
    if (!scan_.at(':')) multiplexing(signal);
    expect(':');
    field(signal);
    signal.range = range();
    signal.unit = printable(text("the unit in quotes"));
    for (DbcText rest(scan_.rest_of_line()); !rest.done(); (void)rest.accept(',')) {
      const std::string_view receiver = rest.word();
      if (receiver.empty()) refuse(fmt::format("a receiver is expected at '{}'", shortened(rest.rest_of_line(), 30)));
    }
    if (!signals_.try_emplace({message_->id, signal.name}, message_->signals.size()).second) refuse("is there twice");
    message_->signals.push_back(std::move(signal));
  }
  void multiplexing(DbcSignal& signal) {
    std::string_view mark = scan_.peek_word();
    signal.is_multiplexer = mark.ends_with('M');
    if (signal.is_multiplexer) mark.remove_suffix(1);
    const auto value = mark.starts_with('m') ? number_in<std::uint64_t>(mark.substr(1)) : std::nullopt;
    if (value) signal.condition = {kNotSaid, {{*value, *value}}};
    if (!value && (!signal.is_multiplexer || !mark.empty())) expected("M, mN, mNM (N a number) or ':'");
    (void)scan_.word();
  }
  void field(DbcSignal& signal) {
    constexpr unsigned kByte = 8;
    const bool packets = message_->is_of_packets();
    const unsigned most = packets ? kByte * message_->size : kByte * sizeof(CanFrame::data);
    BitField& field = signal.field;
    const auto start = number<unsigned>("the first bit", 0, most - 1);
    expect('|');
    const auto bits = number<unsigned>("a number of bits", 1, most);
    expect('@');
    const std::string_view order = scan_.peek_word();
    if (order != "0+" && order != "0-" && order != "1+" && order != "1-")
      expected("byte order and sign (0 or 1, + or -)");
    field.order = order[0] == '1' ? BitField::Order::kLittleEndian : BitField::Order::kBigEndian;
    field.type = order[1] == '-' ? BitField::Type::kSigned : BitField::Type::kUnsigned;
    (void)scan_.word();
    expect('(');
    field.scale = number<double>("the scale", -kLargest, kLargest);
    expect(',');
    field.offset = number<double>("the offset", -kLargest, kLargest);
    expect(')');
    if (field.scale == 0) refuse("has scale 0, and so one value for all that is sent");
    if (packets) signal.first_byte = static_cast<std::uint8_t>(start / kByte);
    field.start_bit = static_cast<std::uint8_t>(start - kByte * signal.first_byte);
    field.bits = static_cast<std::uint8_t>(std::min(bits, kMostBits));
    if (packets && (field.order == BitField::Order::kBigEndian || field.start_bit + bits > kMostBits))
      signal.unusable = "must be little endian and end within 8 bytes, as the message comes in several packets";
    else if (signal.first_byte + bytes_of(field) > message_->size)
      refuse(fmt::format("reaches to byte {}, and the message has {}", signal.first_byte + bytes_of(field),
                         message_->size));
  }
  /// [0|0] is none; and a double's largest value, written with few digits, is beyond it.
  std::optional<std::pair<double, double>> range() {
    expect('[');
    const double least = number_in<double>(scan_.word()).value_or(NAN);
    expect('|');
    const double most = number_in<double>(scan_.word()).value_or(NAN);
    expect(']');
    if (least > most) slip("its least value is above its most: taken as without a range");
    return least < most ? std::optional(std::pair(least, most)) : std::nullopt;
  }

  // ---- What is said of them

  /// CM_ "..."; CM_ BO_ IDENTIFIER "..."; CM_ SG_ IDENTIFIER SIGNAL "..."; for people. One without an end would hide
  /// what follows: refused.
  void comment() {
    if (!scan_.at('"')) {
      const std::string_view of = scan_.word();
      if (of != "BO_" && of != "SG_") return skip();  // of a node or an environment variable
    }
    for (int words = 0; words < 2 && !scan_.at('"'); ++words) (void)scan_.word();
    (void)text("a comment", true);
    end();
  }

  /// SIG_VALTYPE_ IDENTIFIER SIGNAL : TYPE; 0 is an integer, 1 a float, 2 a double.
  void float_type() {
    if (!of_message()) return skip();
    DbcSignal& signal = message_->signals[of_signal()];
    (void)scan_.accept(':');
    const auto type = number<std::uint64_t>("a type", 0, 2);
    end();
    if (type == 0) return;
    if (signal.field.bits != 32 * type)
      refuse(fmt::format("{} of {} is a float of {} bits and must have {}", signal.name, message_->name,
                         signal.field.bits, 32 * type));
    signal.field.type = BitField::Type::kFloat;
  }

  /// SG_MUL_VAL_ IDENTIFIER SIGNAL MULTIPLEXER FROM-TO, FROM-TO ... ;
  void multiplexer_values() {
    if (!of_message()) return skip();
    DbcSignal& signal = message_->signals[of_signal()];
    DbcCondition condition{of_signal(), {}};
    do {
      const std::string_view word = scan_.peek_word();
      const auto dash = word.find('-');
      const auto from = number_in<std::uint64_t>(word.substr(0, dash));
      const auto to = dash == std::string_view::npos ? from : number_in<std::uint64_t>(word.substr(dash + 1));
      if (!from || !to || *from > *to) expected("FROM-TO, two whole numbers in ascending order,");
      (void)scan_.word();
      condition.values.emplace_back(*from, *to);
    } while (scan_.accept(',') && condition.values.size() < kMostRanges);
    if (condition.values.size() == kMostRanges) refuse(fmt::format("must be fewer than {} ranges", kMostRanges));
    end();
    signal.condition = std::move(condition);
  }

  // ---- Attributes of messages

  void attribute_type() {
    const std::string of(scan_.word()), attribute = scan_.at('"') ? text("an attribute's name") : "";
    const bool format = of == "BO_" && attribute == kFormatAttribute, kind = of == "SG_" && attribute == kKindAttribute;
    if ((!format && !kind) || scan_.word() != "ENUM") return skip();
    do (format ? formats_ : kinds_).push_back(text("a value"));
    while (scan_.accept(','));
    end();
  }
  void attribute_default() {
    const std::string attribute = text("an attribute's name");
    if (attribute == kPeriodAttribute) default_period_s_ = period();
    if (attribute == kFormatAttribute) default_format_ = format();
    skip();
  }
  void attribute() {
    const std::string attribute = text("an attribute's name");
    const std::string of(scan_.peek_word());
    if (of != "BO_" && of != "SG_") return skip();
    (void)scan_.word();
    if (!of_message()) return skip();
    const std::string signal = of == "SG_" ? name("a signal's name") : "";
    if (of == "SG_" && attribute == kKindAttribute && (scan_.at('"') || !kinds_.empty())) {
      const std::string kind = chosen_of(kinds_);
      const auto at = signals_.find({message_->id, signal});
      if (at != signals_.end()) {
        message_->signals[at->second].is_counter = kind == kCounterKind;
        message_->signals[at->second].is_checksum = kind == kChecksumKind;
      }
    } else if (of == "BO_" && attribute == kPeriodAttribute)
      periods_s_[message_->id] = period();
    else if (of == "BO_" && attribute == kFormatAttribute)
      format_of_[message_->id] = format();
    else if (scan_.at('"'))
      (void)text("a value");
    else
      (void)name("a value");
    end();
  }
  std::optional<double> period() {
    const double period_ms = number<double>("a time in ms", 0, kLongest_ms);
    return period_ms > 0 ? std::optional(period_ms * 1e-3) : std::nullopt;
  }
  Format format() {
    const std::string name = chosen_of(formats_);
    return {name == "J1939PG", name.ends_with("_FD")};
  }
  /// By its name, or by its place in BA_DEF_.
  std::string chosen_of(const std::vector<std::string>& names) {
    if (scan_.at('"')) return text("a value");
    if (names.empty()) expected("a value in quotes");
    return names[number<std::size_t>("the place of a value", 0, names.size() - 1)];
  }

  // ---- When all is read

  void finish(DbcMessage& message) {
    const auto period = periods_s_.find(message.id);
    message.period_s = period != periods_s_.end() ? period->second : default_period_s_;
    const auto own = format_of_.find(message.id);
    const Format format = own != format_of_.end() ? own->second : default_format_;
    message.j1939 = format.j1939 && (message.id & kExtendedId) != 0;
    if (format.fd && message.unusable.empty())
      message.unusable = fmt::format("line {}: BO_ {}: is of CAN FD (VFrameFormat)", message.line, message.name);
    if (message.unusable.empty() && message.is_of_packets() && !message.j1939) message.unusable = too_long(message);
    try {
      if (!message.unusable.empty()) message.signals.clear();
      for (DbcSignal& signal : message.signals) {
        if (signal.condition && message.is_of_packets()) {
          signal.condition.reset();
          signal.unusable = "is multiplexed, as nobody reads it in a message of several packets";
        }
        if (signal.condition) check_condition(message, signal);
      }
      check_bits(message);
    } catch (const DbcFault& fault) {
      damage(message, fault);
      message.signals.clear();
    }
  }
  const std::string text_;
  DbcText scan_;
  DbcFile file_;
  DbcMessage nobody_;
  int line_ = 0;                                                          // where the statement begins
  std::string key_;                                                       // what it says
  DbcMessage* message_ = nullptr;                                         // of which it says that
  std::map<std::uint32_t, std::size_t> messages_;                         // by identifier
  std::map<std::pair<std::uint32_t, std::string>, std::size_t> signals_;  // by message and name
  std::vector<std::string> formats_, kinds_;                              // that VFrameFormat and SigType may be
  Format default_format_;
  std::map<std::uint32_t, Format> format_of_;
  std::optional<double> default_period_s_;
  std::map<std::uint32_t, std::optional<double>> periods_s_;
  std::vector<DbcFault> slips_;
};

}  // namespace

DbcFile parse_dbc(std::string_view text, const std::string& source) {
  return DbcReader(text, source).read();
}

DbcFile read_dbc(const std::string& path) {
  return parse_dbc(whole_file(path, kLargestDbc_MB), path);
}

}  // namespace knuckle::eds
