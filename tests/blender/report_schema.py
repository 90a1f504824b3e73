"""As much of JSON Schema as docs/report.schema.json uses."""

TYPES = {
    "object": lambda v: isinstance(v, dict),
    "array": lambda v: isinstance(v, list),
    "string": lambda v: isinstance(v, str),
    "boolean": lambda v: isinstance(v, bool),
    "integer": lambda v: isinstance(v, int) and not isinstance(v, bool),
    "number": lambda v: isinstance(v, int | float) and not isinstance(v, bool),
    "null": lambda v: v is None,
}
KNOWN = set("type enum const properties required additionalProperties items minimum $ref".split())
SAID = {"$schema", "$id", "$defs", "title", "description"}


def problems(value, schema, root, path="report"):
    """[text]: where `value` is not as the schema says."""
    assert set(schema) <= KNOWN | SAID, set(schema) - KNOWN - SAID
    if "$ref" in schema:
        return problems(value, root["$defs"][schema["$ref"].rpartition("/")[2]], root, path)
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(TYPES[kind](value) for kind in kinds):
        return [f"{path}: {value!r} is no {' or '.join(kinds)}"]
    found = []
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{path}: {value!r} is none of {schema['enum']}")
    if "const" in schema and value != schema["const"]:
        found.append(f"{path}: {value!r} is not {schema['const']!r}")
    if "minimum" in schema and TYPES["number"](value) and value < schema["minimum"]:
        found.append(f"{path}: {value} is below {schema['minimum']}")
    if isinstance(value, dict):
        own, other = schema.get("properties", {}), schema.get("additionalProperties", True)
        found += [f"{path}: {key} is missing" for key in schema.get("required", []) if key not in value]
        for key, part in value.items():
            if key in own:
                found += problems(part, own[key], root, f"{path}.{key}")
            elif other is False:
                found.append(f"{path}: {key} is told nowhere")
            elif isinstance(other, dict):
                found += problems(part, other, root, f"{path}.{key}")
    if isinstance(value, list) and "items" in schema:
        for number, part in enumerate(value):
            found += problems(part, schema["items"], root, f"{path}[{number}]")
    return found
