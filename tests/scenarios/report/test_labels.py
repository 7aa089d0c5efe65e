"""Cells know the heading of their column, headings over several columns included."""

from scenarios.report.labels import labelled

TABLE = """<p>a</p><table>
<thead><tr class="group"><td></td><th scope="colgroup" colspan="2">against<br><b>truth</b></th></tr>
<tr><th>row</th><th scope="col">x "1"</th><th scope="col">y</th></tr></thead>
<tbody>
<tr><th scope="rowgroup" colspan="3">all</th></tr>
<tr><th scope="row">one</th><td class="split">1</td><td><b>2</b></td></tr>
</tbody></table><p>b</p>"""


def test_cells_have_the_heading_of_their_column_and_the_rest_is_as_it_was():
    before = ('<td class="split">1</td>', "<td><b>2</b></td>")
    one = '<td data-label="against truth x &quot;1&quot;" class="split">1</td>'
    after = (one, '<td data-label="against truth y"><b>2</b></td>')
    assert labelled(TABLE) == TABLE.replace(before[0], after[0]).replace(before[1], after[1])
