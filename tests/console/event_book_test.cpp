// The event book: what is told, found again, acknowledged and written out.
#include "app/console/event_book.h"

#include <gtest/gtest.h>

#include "app/recordings/csv_cells.h"
#include "core/error.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::console {
namespace {

ConsoleEvent machine_event(Mode mode, ReasonCode code = ReasonCode::kNone) {
  ConsoleEvent event;
  event.at = Time(1500ms);
  event.mode = mode;
  event.reason.code = code;
  return event;
}

TEST(EventBook, AFaultIsAnAlarmWithItsCodeItsNodeAndWhatToDoAtTheHandAtWork) {
  BusDescription bus;
  bus.nodes.resize(1);
  bus.nodes[0].name = "boom_encoder";
  bus.nodes[0].id = 0x30;
  ConsoleEvent stale = machine_event(Mode::kFault, ReasonCode::kSensorStale);
  stale.reason.subject = 0x30;
  EventBook book;
  book.add(machine_event(Mode::kFault, ReasonCode::kLinkLost), bus);
  book.add(stale, bus);
  book.add(machine_event(Mode::kReady, ReasonCode::kNoPresence), bus, HandSource::kKeyboard);
  const EventRow& row = book.rows().front();
  EXPECT_EQ(row.severity, Severity::kAlarm);
  EXPECT_EQ(row.code, "link_lost");
  EXPECT_FALSE(row.acknowledged);
  EXPECT_TRUE(test::says(row.text, "check the network"));
  EXPECT_TRUE(test::says(book.rows()[1].text, "boom_encoder (node 0x30)"));
  EXPECT_TRUE(test::says(book.rows()[2].text, "hold Shift"));
}

TEST(EventBook, EveryKindOfEventHasATextOfItsOwn) {
  std::vector<std::string> texts;
  for (int kind = 0; kind <= static_cast<int>(ConsoleEventKind::kNewStart); ++kind) {
    EventBook book;
    ConsoleEvent event = machine_event(Mode::kReady, ReasonCode::kEnergyWatchdog);
    event.kind = static_cast<ConsoleEventKind>(kind);
    book.add(event, {});
    ASSERT_EQ(book.rows().size(), 1u);
    EXPECT_GT(book.rows().front().text.size(), 3u) << kind;
    EXPECT_NE(book.rows().front().code, "?") << kind;
  }
}

TEST(EventBook, FilterFindsBySeverityAndByWordsWhateverTheirCase) {
  EventBook book;
  book.add(machine_event(Mode::kReady), {});
  book.add(machine_event(Mode::kFault, ReasonCode::kSensorStale), {});
  book.add(Time{}, 1, Severity::kWarning, "gamepad", "Gamepad is gone");
  EXPECT_EQ(book.matching({}).size(), 3u);
  EXPECT_EQ(book.matching({Severity::kWarning, ""}).size(), 2u);
  EXPECT_EQ(book.matching({Severity::kAlarm, ""}).size(), 1u);
  EXPECT_EQ(book.matching({Severity::kInfo, "GAMEPAD is"}).size(), 1u);
  EXPECT_EQ(book.matching({Severity::kInfo, "sensor_stale"}).size(), 1u);
  EXPECT_EQ(book.matching({Severity::kInfo, "nothing of the kind"}).size(), 0u);
}

TEST(EventBook, AcknowledgesOneOrAllThatTheFilterShows) {
  EventBook book;
  book.add(machine_event(Mode::kReady), {});
  for (int i = 0; i < 3; ++i) book.add(machine_event(Mode::kFault, ReasonCode::kSensorStale), {});
  book.add(Time{}, 1, Severity::kWarning, "gamepad", "gamepad is gone");
  EXPECT_EQ(book.open(Severity::kInfo), 4u) << "information needs none";
  book.acknowledge(book.rows()[2].number);
  EXPECT_TRUE(book.rows()[2].acknowledged);
  EXPECT_EQ(book.open(Severity::kAlarm), 2u);
  book.acknowledge(EventFilter{Severity::kInfo, "Gamepad"});
  EXPECT_TRUE(book.rows()[4].acknowledged);
  EXPECT_EQ(book.open(Severity::kAlarm), 2u) << "hidden by the filter";
  book.acknowledge(EventFilter{});
  EXPECT_EQ(book.open(Severity::kInfo), 0u);
}

TEST(EventBook, ForgetsWhatIsNotAcknowledgedLastAndSaysSo) {
  EventBook book;
  for (int i = 0; i < 3; ++i) book.add(Time{}, 1, Severity::kAlarm, "alarm", std::to_string(i));
  const std::size_t most = EventBook::kMost;
  for (std::size_t i = 0; i < most + 7; ++i) book.add(Time{}, 1, Severity::kInfo, "n", "");
  EXPECT_EQ(book.open(Severity::kAlarm), 3u);
  EXPECT_EQ(book.forgotten(), 10u);
  EXPECT_EQ(book.rows().back().number, most + 10) << "the newest stays";
  EXPECT_EQ(book.forgotten_open(), 0u);
  for (std::size_t i = 0; i < most; ++i) book.add(Time{}, 1, Severity::kWarning, "w", "");
  EXPECT_EQ(book.rows().size(), most);
  EXPECT_EQ(book.forgotten_open(), 3u) << "warnings, once nothing else could go";
  EXPECT_EQ(book.open(Severity::kAlarm), 3u) << "they sound until somebody has acknowledged them";
}

TEST(EventBook, SaysOnceHowManyEventsWereLost) {
  EventBook book;
  book.note_lost(Time{}, 1, 0);
  EXPECT_TRUE(book.rows().empty());
  book.note_lost(Time{}, 1, 7);
  book.note_lost(Time{}, 1, 7);
  ASSERT_EQ(book.rows().size(), 1u);
  EXPECT_EQ(book.rows().front().text, "7 events lost: too many at a time");
}

TEST(EventBook, ExportsEveryRowAsCsvThatReadsBackWhateverItsText) {
  EventBook book;
  const std::string awkward = "a \"quoted\" word, a comma\r\nand a second line";
  book.add(machine_event(Mode::kFault, ReasonCode::kSensorStale), {});
  book.add(Time(2s), 3, Severity::kWarning, "gamepad", awkward);
  const test::TemporaryFolder folder;
  const std::string file = folder.file("events.csv");
  book.export_csv(file);
  const std::string text = test::content(file);
  EXPECT_EQ(text.substr(0, text.find('\n') + 1), "number,run,time_s,severity,code,text,acknowledged\r\n");
  EXPECT_TRUE(
      test::says(text, "\n2,3,2,warning,gamepad,\"a \"\"quoted\"\" word, a comma\r\nand a second line\",no\r\n"));
  const auto rows = recordings::read_cells(file).rows;
  ASSERT_GE(rows.size(), 2u);
  EXPECT_EQ(rows[1][4], "sensor_stale");
  EXPECT_EQ(rows[1][2], "1.5");
}

TEST(EventBook, ExportsWhatTheFilterShowsAndKeepsTheFileBefore) {
  EventBook book;
  book.add(machine_event(Mode::kFault, ReasonCode::kSensorStale), {});
  const test::TemporaryFolder folder;
  const std::string file = folder.file("events.csv");
  EXPECT_EQ(book.export_csv(file), "");
  book.add(Time{}, 1, Severity::kWarning, "gamepad", "gamepad is gone");
  const std::string kept = book.export_csv(file, {Severity::kInfo, "gamepad"});
  const auto now = recordings::read_cells(file).rows, before = recordings::read_cells(kept).rows;
  ASSERT_EQ(now.size(), 2u);
  EXPECT_EQ(now[1][4], "gamepad");
  ASSERT_EQ(before.size(), 2u);
  EXPECT_EQ(before[1][4], "sensor_stale");
  EXPECT_THROW(book.export_csv("/dev/null/at/all.csv"), InputError);
}

}  // namespace
}  // namespace knuckle::console
