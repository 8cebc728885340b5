!> The discrete Moser-Veselov method in double precision: the text that the charts time.
module frb_double_dmv
    use frb_kinds, only: rk => wp
    implicit none
    private

    public :: dmv_body, new_dmv_body, dmv_steps

    include '../app/charts/rivals/dmv.inc'

end module frb_double_dmv
