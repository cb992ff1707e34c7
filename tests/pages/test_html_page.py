"""What pages are filled with cannot become a part of them."""

from fem_impact.pages import html_page


def test_data_cannot_close_the_script_around_them_and_are_json():
    data = {"title": "</script><b>", "numbers": [1.5, float("nan")]}
    assert html_page.script_data(data) == '{"title":"\\u003c/script>\\u003cb>","numbers":[1.5,null]}'
