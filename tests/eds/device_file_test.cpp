// A vendor's device file: what it says, the slips of files in the field, and what is refused.
#include "app/eds/device_file.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/eds/machine_texts.h"
#include "tests/support/refusal.h"

namespace knuckle::eds {
namespace {

using test::says;

const std::string kHead = R"([DeviceInfo]
VendorName=Maker
VendorNumber=0x19
ProductName=Valve
ProductNumber=0x408
BaudRate_125=0
BaudRate_250=1
BaudRate_500=1
LSS_Supported=1
[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1018
[1000]
ParameterName=device type
DataType=0x0007
AccessType=ro
DefaultValue=0x198
[1018]
SubNumber=3
[1018sub1]
DataType=7
AccessType=ro
DefaultValue=0x19
[1018sub2]
DataType=7
AccessType=ro
DefaultValue=0x408
)";

DeviceFile parse(const std::string& text) {
  return parse_device_file(text, "a.eds");
}
std::string refused(const std::string& text) {
  return test::refusal([&] { return parse(text); });
}

TEST(DeviceFile, SaysWhoTheDeviceIsAndWhatTheBusMayBe) {
  const DeviceFile file = parse(kHead);
  EXPECT_EQ(file.device_type, 0x198U);
  EXPECT_EQ(file.vendor, 0x19U);
  EXPECT_EQ(file.product, 0x408U);
  EXPECT_EQ(file.vendor_name, "Maker");
  EXPECT_EQ(file.bit_rates_kbps, (std::vector<int>{250, 500}));
  EXPECT_TRUE(file.lss);
  EXPECT_TRUE(file.slips.empty()) << file.slips[0];
}

/// One object 0x1800:01 with this DefaultValue and data type.
DeviceFile with_default(const std::string& value, const std::string& type = "0x0007") {
  return parse(kHead + "[1800sub1]\nDataType=" + type + "\nAccessType=rw\nDefaultValue=" + value + "\n");
}

TEST(DeviceFile, ReadsNumbersInEverySpellingThatIsSure) {
  struct Case {
    const char* text;
    std::int64_t number;
    bool plus_node_id;
  };
  for (const Case& c : std::initializer_list<Case>{{"0x180", 0x180, false},
                                                   {"0X1f", 0x1F, false},
                                                   {"4294967295", 0xFFFFFFFF, false},
                                                   {"-5", -5, false},
                                                   {"0", 0, false},
                                                   {"$NODEID", 0, true},
                                                   {"$NODEID+0x180", 0x180, true},
                                                   {"$NodeId + 384", 384, true},
                                                   {"0x180+$NODEID", 0x180, true}}) {
    const auto value = with_default(c.text).find({0x1800, 1})->value;
    ASSERT_TRUE(value) << c.text;
    EXPECT_EQ(value->number, c.number) << c.text;
    EXPECT_EQ(value->plus_node_id, c.plus_node_id) << c.text;
  }
  EXPECT_EQ(with_default("$NODEID+0x180").find({0x1800, 1})->value->of(0x10), 0x190U);
}

TEST(DeviceFile, DoesNotGuessWhatANumberIs) {
  for (const char* text : {"010", "0x", "12 34", "1.5", "0x1FFFFFFFF", "$NODEID-1", "$NODEIDx", "five", "+5"}) {
    const DeviceFile file = with_default(text);
    EXPECT_FALSE(file.find({0x1800, 1})->value) << text;
    EXPECT_TRUE(says(file.slips, "DefaultValue of [1800sub1]")) << text;
  }
  const DeviceFile named = with_default("a name", "0x0009");  // a text has no number, and that is no slip
  EXPECT_FALSE(named.find({0x1800, 1})->value);
  EXPECT_TRUE(says(named.slips, "0x1800 has a section") || named.slips.empty());
}

TEST(DeviceFile, OfCompactSubObjectsHasEachWithItsOwnValueAndName) {
  const DeviceFile file = parse(kHead + R"([6300]
ParameterName=set-point
DataType=3
AccessType=rww
PDOMapping=1
DefaultValue=7
CompactSubObj=3
[6300Value]
NrOfEntries=1
2=9
[6300Name]
3=third
)");
  EXPECT_EQ(file.find({0x6300, 0})->value->number, 3);
  EXPECT_EQ(file.find({0x6300, 0})->access, Access::kReadOnly);
  EXPECT_EQ(file.find({0x6300, 1})->value->number, 7);
  EXPECT_EQ(file.find({0x6300, 2})->value->number, 9);
  EXPECT_EQ(file.find({0x6300, 3})->name, "third");
  EXPECT_EQ(file.find({0x6300, 3})->access, Access::kReadWrite);
  EXPECT_TRUE(file.find({0x6300, 3})->mappable.value_or(false));
  EXPECT_EQ(file.find({0x6300, 4}), nullptr);
}

TEST(DeviceFile, IsReadWithTheLineEndsBytesAndCaseOfOtherComputers) {
  std::string text = "; a comment\r\n# another\r\n" + kHead;
  for (auto at = text.find("\n["); at != std::string::npos; at = text.find("\n[", at + 2)) text.replace(at, 1, "\r\n");
  text += "[6042]\r\nPARAMETERNAME=Ventil f";
  const std::string rest = "r\r\ndatatype=2\r\nACCESSTYPE=RW\r\n";
  for (const std::string& whole :
       {text + "\xFC" + rest, text + "\xFC" + rest + '\x1A', "\xEF\xBB\xBF" + text + "\xC3\xBC" + rest}) {
    const DeviceFile file = parse(whole);
    EXPECT_EQ(file.vendor, 0x19U);
    EXPECT_EQ(file.find({0x6042, 0})->name, "Ventil f\xC3\xBCr");
    EXPECT_EQ(file.find({0x6042, 0})->access, Access::kReadWrite);
  }
}

TEST(DeviceFile, TellsEverySlipWithItsLine) {
  struct Case {
    const char* more;
    const char* told;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"[OptionalObjects]\nSupportedObjects=1\n1=0x2000\n",
            "[OptionalObjects] lists '0x2000', which has no section"},
           {"[OptionalObjects]\nSupportedObjects=3\n", "[OptionalObjects] says 3 objects and lists 0"},
           {"[2000]\nDataType=7\nAccessType=rw\n", "0x2000 has a section, but no list names it"},
           {"[2000]\nDataType=7\n[Comments]\n", "[2000] has no AccessType: taken as read-only"},
           {"[2000]\nParameterName=x\n[Comments]\n", "[2000] has no DataType: passed over"},
           {"[1000]\nDataType=7\n", "[1000] stands twice"},
           {"[2000sub1]\nDataType=7\nDataType=6\nAccessType=ro\n", "DataType stands twice in [2000sub1]"},
           {"[2000subFF]\nDataType=7\nAccessType=ro\n", "[2000subFF] is no object's name"},
           {"[2000]\nDataType=seven\nAccessType=rw\n[Comments]\n",
            "DataType of [2000]: must be a number of CiA 301: passed over"},
           {"[5FFFsub1]\nDataType=\nAccessType=rw\n[Comments]\n", "[5FFFsub1] has no DataType: passed over"},
           {"[2000]\nDataType=7\nAccessType=maybe\n", "AccessType of [2000]: must be ro, wo, rw, rwr, rww or const"},
           {"[2000]\nDataType=7\nAccessType=ro\nCompactSubObj=300\n",
            "CompactSubObj of [2000]: must be within [0, 254]: passed over"},
           {"[2000]\nDataType=x\nAccessType=ro\nCompactSubObj=2\n", "DataType of [2000]: must be a number"},
           {"[2000]\nDataType=7\nAccessType=rw\nDefaultValue=1e3\n",
            "DefaultValue of [2000] is not a number that can be read"},
           {"what is this\n", "is neither a section nor a key"},
           {"[1A01sub1]\nDataType=7\nAccessType=rw\nDefaultValue=0x33010010\n", "0x1A01:01 maps 0x3301:00"},
           {"[1018sub2]\n[DeviceInfo]\nProductNumber=5\n", "ProductNumber stands twice"}}) {
    const DeviceFile file = parse(kHead + c.more);
    ASSERT_TRUE(says(file.slips, c.told)) << c.more;
    EXPECT_EQ(file.slips[0].rfind("line ", 0), 0U) << file.slips[0];
    EXPECT_EQ(file.vendor, 0x19U) << c.more;
  }
  const DeviceFile skipped = parse(kHead + "[1600sub0]\nDataType=5\nAccessType=rw\nDefaultValue=1\n" +
                                   "[1600sub1]\nDataType=7\nAccessType=rw\nDefaultValue=0x00030010\n");
  EXPECT_FALSE(says(skipped.slips, " maps ")) << "neither the count nor two bytes to skip, an entry of CiA 301";
}

TEST(DeviceFile, TakesTheObjectsIdentityBeforeTheHeads) {
  std::string text = kHead;
  text.replace(text.find("ProductNumber=0x408"), 19, "ProductNumber=0x409");
  const DeviceFile other = parse(text);
  EXPECT_EQ(other.product, 0x408U);
  EXPECT_TRUE(says(other.slips, "ProductNumber is 0x409, and 0x408 in 0x1018:02"));
  text = kHead;
  text.erase(text.rfind("DefaultValue=0x408"));
  EXPECT_EQ(parse(text).product, 0x408U) << "what an object does not say, the head does";
}

TEST(DeviceFile, ADamagedObjectOfTheVendorsOwnLeavesTheOthersAsTheyAre) {
  const std::string listed = "[ManufacturerObjects]\nSupportedObjects=2\n1=0x2000\n2=0x2001\n";
  const DeviceFile file =
      parse(kHead + listed + "[2000]\nDataType=x\nAccessType=rw\n[2001]\nDataType=6\nAccessType=rw");
  EXPECT_EQ(file.slips,
            std::vector<std::string>{"line 34: DataType of [2000]: must be a number of CiA 301: passed over"});
  EXPECT_EQ(file.find({0x2000, 0}), nullptr);
  ASSERT_NE(file.find({0x2001, 0}), nullptr);
  EXPECT_EQ(file.find({0x2001, 0})->type_line, 37);
}

/// kHead with one text, or two, in place of others.
std::string with(const std::string& was, const std::string& is, const std::string& other = "",
                 const std::string& other_is = "") {
  std::string text = kHead;
  text.replace(text.find(was), was.size(), is);
  return other.empty() ? text : text.replace(text.find(other), other.size(), other_is);
}

TEST(DeviceFile, RefusesAFileThatWasCutOff) {
  const std::string whole = kHead + "[OptionalObjects]\nSupportedObjects=1\n1=0x2000\n";
  struct Case {
    const char *end, *why;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"[2000]\nParameterName=x\n", "line 32: [2000]: the file ends in it, before its DataType and AccessType"},
           {"[2000]\nDataType=7\n", "line 32: [2000]: the file ends in it, before its DataType and AccessType"},
           {"[2000sub1]\nDataType=7\nAccessType=rw\nDefau", "line 35: Defau: the file ends in the middle of this line"},
           {"[2001]\nDataType=7\nAccessType=rw\nDefaultValue=0x1",
            "line 31: [OptionalObjects] lists '0x2000': has no section"}})
    EXPECT_EQ(refused(whole + c.end).substr(0, 7 + std::string(c.why).size()), std::string("a.eds: ") + c.why);
  EXPECT_EQ(refused(whole + "[2000]\nDataType=7\nAccessType=rw"), "accepted") << "no line feed at the end is no fault";
}

TEST(DeviceFile, RefusesInOneLineWithLineAndKey) {
  struct Case {
    std::string text, why;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"", "a.eds: is not an EDS file: it has no section of an object, such as [1000]"},
           {"# Valve\n\nAn *EDS* is a\n[device](file.md)\n",
            "a.eds: line 3: 'An *EDS* is a': is not an EDS file: it has"},
           {"[links.boom]\nlength_m = 2\n", "a.eds: line 1: '[links.boom]': is not an EDS file: it has no section of"},
           {std::string("[DeviceInfo]\n\0\n", 15), "a.eds: is not an EDS file: it has bytes that no text has"},
           {"[1000]\nDataType=7\nAccessType=ro\nDefaultValue=1\n", "a.eds: 0x1018:01 has no value"},
           {"\n[1000]\nDataType=7\nAccessType=ro\nDefaultValue=\n",
            "a.eds: line 2: DefaultValue of 0x1000:00: is missing: who this device is, is not known"},
           {with("VendorNumber=0x19", "VendorNumber=0x100000019", "DefaultValue=0x19\n", "\n"),
            "a.eds: line 3: VendorNumber of [DeviceInfo]: must be a whole number from 0 to 0xFFFFFFFF"},
           {with("2=0x1018", "2=0x1017"), "a.eds: line 13: [MandatoryObjects] lists '0x1017': has no section"},
           {kHead + "[2000\nDataType=7\n", "a.eds: line 29: [2000: has no closing bracket"},
           {kHead + "[6042]\nDataType=seven\n", "a.eds: line 30: DataType of [6042]: must be a number of CiA 301"},
           {kHead + "[1017]\nDataType=7\nAccessType=maybe\n",
            "a.eds: line 31: AccessType of [1017]: must be ro, wo, rw, rwr, rww or const"},
           {kHead + "[1FFF]\nDataType=0\nAccessType=ro\n",
            "a.eds: line 30: DataType of [1FFF]: must be a number of CiA 301"},
           {kHead + "[6000]\nDataType=7\nAccessType=ro\nCompactSubObj=300\n",
            "a.eds: line 32: CompactSubObj of [6000]: must be within [0, 254]"}}) {
    EXPECT_EQ(refused(c.text).substr(0, c.why.size()), c.why);
  }
}

}  // namespace
}  // namespace knuckle::eds
