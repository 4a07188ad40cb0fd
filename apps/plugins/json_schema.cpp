#include "json_schema.hpp"

#include <cmath>

namespace vantage::documentation {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Value& value) {
  struct Writer {
    Json operator()(const Array& array) const {
      Json json = Json::array();
      for (const Value& element : array) json.push_back(to_json(element));
      return json;
    }
    Json operator()(const Table& table) const {
      Json json = Json::object();
      for (const Entry& entry : table.entries) json[entry.key] = to_json(entry.value);
      return json;
    }
    Json operator()(bool x) const { return x; }
    Json operator()(std::int64_t x) const { return x; }
    Json operator()(double x) const { return x; }
    Json operator()(const std::string& x) const { return x; }
  };
  return std::visit(Writer{}, value.data);
}

/// A bound of an integer is written as an integer.
Json bound(double x, ValueKind kind) {
  if (kind == ValueKind::integer && x == std::round(x) && std::abs(x) < 0x1p53) {
    return static_cast<std::int64_t>(x);
  }
  return x;
}

Json table_schema(const std::vector<ParameterDoc>& fields);

/// The schema of a value, or of an array's elements.
Json value_schema(const ParameterDoc& p) {
  Json schema = Json::object();
  switch (p.kind) {
    case ValueKind::boolean: schema["type"] = "boolean"; break;
    case ValueKind::integer: schema["type"] = "integer"; break;
    case ValueKind::number: schema["type"] = "number"; break;
    case ValueKind::choice:
      schema["type"] = "string";
      schema["enum"] = p.choices;
      break;
    case ValueKind::string:
    case ValueKind::path: schema["type"] = "string"; break;
    case ValueKind::table:
      if (p.fields.empty()) {
        schema["type"] = "object";
      } else {
        schema = table_schema(p.fields);
      }
      break;
  }
  if (p.kind == ValueKind::integer || p.kind == ValueKind::number) {
    if (std::isfinite(p.range.min)) {
      schema[p.range.min_open ? "exclusiveMinimum" : "minimum"] = bound(p.range.min, p.kind);
    }
    if (std::isfinite(p.range.max)) {
      schema[p.range.max_open ? "exclusiveMaximum" : "maximum"] = bound(p.range.max, p.kind);
    }
  }
  return schema;
}

Json parameter_schema(const ParameterDoc& p) {
  Json schema = value_schema(p);
  if (p.array) {
    schema = Json{{"type", "array"}, {"items", std::move(schema)}};
    if (p.length) {
      schema["minItems"] = *p.length;
      schema["maxItems"] = *p.length;
    }
  }
  if (p.kind != ValueKind::choice && !p.choices.empty()) {
    schema = Json{{"anyOf", {{{"type", "string"}, {"enum", p.choices}}, std::move(schema)}}};
  }
  if (p.default_value) schema["default"] = to_json(*p.default_value);
  schema["description"] = p.doc;
  if (!p.unit.empty()) schema["x-unit"] = p.unit;
  if (!p.equation.empty()) schema["x-equation"] = p.equation;
  if (!p.citation.empty()) schema["x-citation"] = p.citation;
  return schema;
}

Json table_schema(const std::vector<ParameterDoc>& fields) {
  Json properties = Json::object();
  Json required = Json::array();
  for (const ParameterDoc& p : fields) {
    properties[p.key] = parameter_schema(p);
    if (p.required) required.push_back(p.key);
  }
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}

}  // namespace

nlohmann::ordered_json json_schema(const PluginInfo& plugin) {
  Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"},
              {"title", std::string(to_string(plugin.kind)) + " " + plugin.name},
              {"description", plugin.summary}};
  schema.update(table_schema(plugin.parameters));
  return schema;
}

}  // namespace vantage::documentation
