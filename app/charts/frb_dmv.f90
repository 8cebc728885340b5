!> A rival: the preprocessed discrete Moser-Veselov method of Hairer and Vilmart, orders 2 to 10.
module frb_dmv
    use frb_kinds, only: rk => wp
    implicit none
    private

    public :: dmv_body, new_dmv_body, dmv_steps

    ! fpm does not see changes of included files: remove build/ after one.
    include 'rivals/dmv.inc'

end module frb_dmv
