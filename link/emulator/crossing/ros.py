"""What the tokens of ROS 2 over Zenoh tell of services.

The liveliness token of an entity reads (rmw_zenoh, design.md)

    @ros2_lv/DOMAIN/SESSION/NODE_ID/ENTITY_ID/KIND/ENCLAVE/NAMESPACE/NODE/NAME/TYPE/HASH/QOS

with `%` for each slash within a part.
"""

_SERVICE_PARTS = 13
_SERVICE_SERVER = "SS"


def service_key(token: str) -> str | None:
    """The key on which the service of a token replies; `None` if it is no service's token."""
    parts = token.split("/")
    if len(parts) != _SERVICE_PARTS or parts[0] != "@ros2_lv" or parts[5] != _SERVICE_SERVER:
        return None
    domain, name, type_name, type_hash = parts[1], parts[9], parts[10], parts[11]
    return f"{domain}/{name.replace('%', '/').strip('/')}/{type_name}/{type_hash}"
