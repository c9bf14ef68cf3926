"""The settings: defaults, every refusal, and what two of them forbid together."""

from __future__ import annotations

import pytest

from service.operations.settings import Settings, setting_fields, variable
from service.operations.settings_environment import SettingsError, as_environment, read_settings

BAD = [
    ("host", "a b"),
    ("port", "65536"),
    ("port", "-1"),
    ("port", "8000.0"),
    ("uds", "/run/" + 101 * "s"),
    ("workers", "0"),
    ("workers", "many"),
    ("api_keys", "one,two three"),
    ("api_keys", "schlüssel"),
    ("api_keys", 257 * "k"),
    ("owner_keys", "lab"),
    ("owner_keys", "lab:"),
    ("owner_keys", "Lab:key"),
    ("owner_keys", 33 * "l" + ":key"),
    ("owner_keys", "lab:one,other:one"),
    ("allowed_hosts", "http://x"),
    ("allowed_hosts", "x:80"),
    ("allowed_origins", "lab.example"),
    ("allowed_origins", "*"),
    ("allowed_origins", "https://lab.example/path"),
    ("max_sessions", "0"),
    ("full_at", "1.1"),
    ("session_idle", "nan"),
    ("session_idle", "inf"),
    ("session_idle", "0"),
    ("max_renders", "0"),
    ("render_seconds_per_client", "0.5"),
    ("render_seconds", "nan"),
    ("solves_per_client", "0"),
    ("max_solves", "1.5"),
    ("max_duration", "-3"),
    ("max_body", "1"),
    ("stream_block", "1"),
    ("lead", "1.01"),
    ("lead", "-0.1"),
    ("max_silence", "0"),
    ("max_updates", "9"),
    ("root_path", "/a/"),
    ("node", "a.b"),
    ("resume", "-1"),
    ("slow_reader", "0.01"),
    ("file_folder", "a\0b"),
    ("data_folder", "a\0b"),
    ("prepare_textures", "yes"),
    ("max_import", "134217729"),
    ("imports_per_client", "0"),
    ("import_bytes_per_client", "1000"),
    ("max_imports", "0"),
    ("textures_per_key", "-1"),
    ("texture_bytes_per_key", "1e9"),
    ("web", "/a/folder/that/is/not/there"),
    ("cache_bytes", "1e6"),
    ("live_bytes", "1000"),
    ("shutdown_timeout", "0"),
    ("streams_per_key", "0"),
    ("streams_per_address", "-1"),
    ("requests_per_second", "0"),
    ("requests_per_second", "inf"),
    ("request_burst", "0.5"),
    ("max_stream", "0"),
    ("max_updates", "0"),
    ("max_message", "10"),
    ("trusted_proxies", "proxy.example"),
    ("trusted_proxies", "10.0.0.1/8"),
    ("log_level", "loud"),
    ("log_format", "xml"),
]


def test_nothing_set_is_the_defaults() -> None:
    assert read_settings({}) == Settings()
    assert read_settings({variable(entry.name): "" for entry in setting_fields()}) == Settings()


def test_the_defaults_are_safe() -> None:
    settings = Settings()
    assert settings.host == "127.0.0.1"
    assert settings.allowed_hosts == ("localhost", "127.0.0.1", "[::1]")
    assert settings.allowed_origins == ()


@pytest.mark.parametrize(("name", "text"), BAD)
def test_a_bad_value_is_refused_by_name_value_and_range(name: str, text: str) -> None:
    with pytest.raises(SettingsError) as refused:
        read_settings({variable(name): text})
    (fault,) = refused.value.faults
    assert fault.pointer == variable(name) == f"RIDGEWAVE_{name.upper()}"
    assert fault.allowed and fault.hint
    assert variable(name) in str(refused.value)


def test_every_setting_that_can_be_wrong_is_tried() -> None:
    assert {name for name, _ in BAD} == {entry.name for entry in setting_fields()}


def test_a_key_is_never_shown() -> None:
    for variables in (
        {"RIDGEWAVE_API_KEYS": "very secret"},
        {"RIDGEWAVE_OWNER_KEYS": "very secret"},
        {"RIDGEWAVE_OWNER_KEYS": "lab:secret,other:secret"},
        {"RIDGEWAVE_OWNER_KEYS": "lab:secret", "RIDGEWAVE_API_KEYS": "secret"},
    ):
        with pytest.raises(SettingsError) as refused:
            read_settings(variables)
        assert "secret" not in str(refused.value)


def test_all_faults_are_told_at_once() -> None:
    with pytest.raises(SettingsError) as refused:
        read_settings({"RIDGEWAVE_PORT": "x", "RIDGEWAVE_LEAD": "2"})
    assert [fault.pointer for fault in refused.value.faults] == ["RIDGEWAVE_PORT", "RIDGEWAVE_LEAD"]


def test_origins_are_read_as_browsers_send_them() -> None:
    given = "https://Lab.Example, https://a.example:443,http://a.example:80,http://a.example:443,http://[::1]:8000"
    expected = (
        "https://lab.example",
        "https://a.example",
        "http://a.example",
        "http://a.example:443",
        "http://[::1]:8000",
    )
    assert read_settings({"RIDGEWAVE_ALLOWED_ORIGINS": given}).allowed_origins == expected
    assert read_settings({"RIDGEWAVE_API_KEYS": 256 * "k"}).api_keys == (256 * "k",)


def test_every_host_needs_a_key() -> None:
    with pytest.raises(SettingsError):
        read_settings({"RIDGEWAVE_ALLOWED_HOSTS": "*"})
    assert read_settings({"RIDGEWAVE_ALLOWED_HOSTS": "*", "RIDGEWAVE_API_KEYS": "k"}).allowed_hosts == ("*",)
    assert read_settings({"RIDGEWAVE_ALLOWED_HOSTS": "*", "RIDGEWAVE_OWNER_KEYS": "lab:k"}).requires_key


def test_an_option_wins_over_the_environment_and_none_does_not() -> None:
    settings = read_settings({"RIDGEWAVE_PORT": "9000", "RIDGEWAVE_WORKERS": "2"}, port=9001, workers=None)
    assert (settings.port, settings.workers) == (9001, 2)
    with pytest.raises(SettingsError):
        read_settings({}, host="")


def test_workers_read_back_what_the_parent_was_told() -> None:
    environment = {
        "RIDGEWAVE_API_KEYS": "a,b",
        "RIDGEWAVE_OWNER_KEYS": "lab:c:d,lab:e",
        "RIDGEWAVE_LEAD": "0.125",
        "RIDGEWAVE_ROOT_PATH": "/lab/touch",
        "RIDGEWAVE_TRUSTED_PROXIES": "10.0.0.0/8, ::1",
    }
    told = read_settings(environment, port=9001, workers=3)
    assert read_settings(as_environment(told)) == told
